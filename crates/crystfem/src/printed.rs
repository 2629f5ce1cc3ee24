//! Printed parts in a few lines: a mesh with layers or a tool path, a material, boundary conditions.

use crate::boundary::{Condition, FaceSelection, Field, Schedule};
use crate::error::Error;
use crate::material::{ThermalMaterial, fill_elements};
use crate::mesh::layers::Layers;
use crate::mesh::path::{CellSettings, ToolPath};
use crate::mesh::{Bar, Face, Mesh};
use crate::print_plan::PrintPlan;
use crate::problem::Problem;
use crate::simulation::{Settings, Simulation};
use std::sync::Arc;

/// Order of a print.
enum Order {
    Layers(Layers),
    /// Path, time of each element on it, s, fill fractions, and index of each element's fraction.
    Path(Box<ToolPath>, Vec<f64>, (Vec<f64>, Vec<usize>)),
}

/// A part that is printed layer by layer or along a tool path.
///
/// By default layers appear every 20 s at 220 °C, a path has the temperatures of its nozzle, and the surface
/// is adiabatic.
pub struct PrintedPart {
    mesh: Mesh,
    order: Order,
    material: Arc<dyn ThermalMaterial>,
    substrate: Option<(Arc<dyn ThermalMaterial>, f64)>,
    interval: f64,
    temperature: Option<f64>,
    held: Vec<(String, f64)>,
    /// Conditions on the outer surface without the held faces, as functions of it.
    outer: Vec<Box<dyn Fn(FaceSelection) -> Condition>>,
}

impl PrintedPart {
    /// Returns a part of layers of a mesh, of one material.
    pub fn new(mesh: Mesh, layers: Layers, material: impl ThermalMaterial + 'static) -> Self {
        Self::ordered(mesh, Order::Layers(layers), material)
    }

    /// Returns a part of cells filled by the beads of a path, printed in the order of its moves.
    ///
    /// # Errors
    /// Errors of [`ToolPath::deposit`].
    pub fn along_path(
        path: ToolPath,
        cells: &CellSettings,
        material: impl ThermalMaterial + 'static,
    ) -> Result<Self, Error> {
        let deposit = path.deposit(cells)?;
        let fill = deposit.voxels.bins();
        Ok(Self::ordered(deposit.voxels.mesh, Order::Path(Box::new(path), deposit.times, fill), material))
    }

    fn ordered(mesh: Mesh, order: Order, material: impl ThermalMaterial + 'static) -> Self {
        Self {
            mesh,
            order,
            material: Arc::new(material),
            substrate: None,
            interval: 20.0,
            temperature: None,
            held: Vec::new(),
            outer: Vec::new(),
        }
    }

    /// Returns a bar, Fig. 4.2.
    ///
    /// # Errors
    /// Errors of [`Bar::mesh`].
    pub fn bar(bar: &Bar, material: impl ThermalMaterial + 'static) -> Result<Self, Error> {
        let mesh = bar.mesh()?;
        let layers = Layers::from_sets(&mesh, "layer-")?;
        Ok(Self::new(mesh, layers, material))
    }

    /// Sets material and initial temperature, K, of elements outside all layers.
    pub fn substrate(mut self, material: impl ThermalMaterial + 'static, temperature: f64) -> Self {
        self.substrate = Some((Arc::new(material), temperature));
        self
    }

    /// Sets the time between layers, s; the first layer exists at the start.
    pub fn layer_every(mut self, seconds: f64) -> Self {
        self.interval = seconds;
        self
    }

    /// Sets the deposition temperature, K.
    pub fn deposited_at(mut self, kelvin: f64) -> Self {
        self.temperature = Some(kelvin);
        self
    }

    /// Holds a surface of the mesh at a temperature, K.
    pub fn hold_surface(mut self, surface: &str, kelvin: f64) -> Self {
        self.held.push((surface.to_owned(), kelvin));
        self
    }

    /// Adds heat loss h (T − T_a) on the current outer surface, except held faces: h in W/(m² K), T_a in K.
    pub fn convection(mut self, coefficient: f64, ambient: f64) -> Self {
        self.outer.push(Box::new(move |surface| Condition::Film {
            surface,
            coefficient: Schedule::constant(coefficient),
            ambient: Schedule::constant(ambient),
        }));
        self
    }

    /// Adds heat loss ε σ (T⁴ − T_a⁴) on the current outer surface, except held faces: ε from 0 to 1, T_a in
    /// K.
    pub fn radiation(mut self, emissivity: f64, ambient: f64) -> Self {
        self.outer.push(Box::new(move |surface| Condition::Radiation {
            surface,
            emissivity,
            ambient: Schedule::constant(ambient),
        }));
        self
    }

    /// Returns the problem, to which conditions and sources may be added.
    ///
    /// # Errors
    /// [`Error::Mesh`] for an unknown surface, and for elements outside all layers without a substrate;
    /// [`Error::Parameter`] for a time between layers that is not positive. [`Simulation::new`] checks the
    /// rest.
    pub fn problem(self) -> Result<Problem, Error> {
        let Self { mesh, order, material, substrate, interval, temperature, held, outer } = self;
        if !(interval > 0.0 && interval.is_finite()) {
            let allowed = "above 0 s, finite".into();
            return Err(Error::Parameter { name: "time between layers", found: interval, allowed });
        }
        let (plan, fill) = match order {
            Order::Layers(layers) => {
                let kelvin = temperature.unwrap_or(493.15);
                (PrintPlan::in_layers(layers.elements, 0.0, interval, |_| kelvin), None)
            }
            Order::Path(path, times, fill) => {
                let given = temperature.map(Schedule::constant);
                (PrintPlan::along_path(&path, &times, 0.0, None, given.as_ref())?, Some(fill))
            }
        };
        let births = plan.births;
        let mut material_of = vec![1; mesh.element_count()];
        let printed = births.iter().flat_map(|birth| &birth.elements);
        printed.for_each(|&element| material_of[element as usize] = 0);
        let beside = material_of.iter().filter(|&&material| material == 1).count();
        let mut start = births.first().map_or(f64::NAN, |birth| birth.temperature);
        let mut materials = vec![material];
        match substrate {
            Some((material, temperature)) => {
                materials.push(material);
                start = temperature;
            }
            None if beside > 0 => {
                return Err(Error::Mesh(format!("{beside} elements are in no layer: they need a substrate")));
            }
            None => {}
        }
        let mut conditions = Vec::new();
        let mut except: Vec<Face> = Vec::new();
        for (name, kelvin) in held {
            let faces = mesh.surfaces.get(&name).ok_or_else(|| {
                let known: Vec<&str> = mesh.surfaces.keys().map(String::as_str).collect();
                Error::Mesh(format!("no surface `{name}`; allowed: {}", known.join(", ")))
            })?;
            except.extend(faces);
            let nodes = mesh.nodes_of(faces);
            conditions.push(Condition::Temperature { nodes, value: Field::constant(kelvin) });
        }
        conditions
            .extend(outer.iter().map(|condition| condition(FaceSelection::Outer { except: except.clone() })));
        let whole = Problem::new(mesh, materials[0].clone(), start);
        if let Some((parts, part_of)) = &fill {
            fill_elements(&mut materials, &mut material_of, parts, part_of)?;
        }
        Ok(Problem { materials, material_of, conditions, births, ..whole })
    }

    /// Returns the simulation at the start of the print.
    ///
    /// # Errors
    /// Errors of [`Self::problem`] and [`Simulation::new`].
    pub fn simulate(self, settings: Settings) -> Result<Simulation, Error> {
        Simulation::new(self.problem()?, settings)
    }
}
