//! Printed parts in a few lines: a mesh with layers, a material, what surrounds it.

use crate::boundary::{Condition, Field, Schedule, Where};
use crate::error::Error;
use crate::material::ThermalMaterial;
use crate::mesh::layers::Layers;
use crate::mesh::{Bar, Face, Mesh};
use crate::problem::{Birth, Problem};
use crate::simulation::{Settings, Simulation};
use std::sync::Arc;

/// A part that is printed layer by layer.
///
/// Unless told otherwise layers come every 20 s at 220 °C, and no heat crosses the surface.
pub struct PrintedPart {
    mesh: Mesh,
    layers: Layers,
    material: Arc<dyn ThermalMaterial>,
    substrate: Option<(Arc<dyn ThermalMaterial>, f64)>,
    interval: f64,
    temperature: f64,
    held: Vec<(String, f64)>,
    /// Conditions on the outer surface but the held ones, by their place.
    outer: Vec<Box<dyn Fn(Where) -> Condition>>,
}

impl PrintedPart {
    /// Layers of a mesh, of one material.
    pub fn new(mesh: Mesh, layers: Layers, material: impl ThermalMaterial + 'static) -> Self {
        Self {
            mesh,
            layers,
            material: Arc::new(material),
            substrate: None,
            interval: 20.0,
            temperature: 493.15,
            held: Vec::new(),
            outer: Vec::new(),
        }
    }

    /// A bar, Fig. 4.2.
    ///
    /// # Errors
    /// As [`Bar::mesh`].
    pub fn bar(bar: &Bar, material: impl ThermalMaterial + 'static) -> Result<Self, Error> {
        let mesh = bar.mesh()?;
        let layers = Layers::from_sets(&mesh, "layer-")?;
        Ok(Self::new(mesh, layers, material))
    }

    /// What the mesh has beside the layers, and its temperature at the start, K.
    pub fn substrate(mut self, material: impl ThermalMaterial + 'static, temperature: f64) -> Self {
        self.substrate = Some((Arc::new(material), temperature));
        self
    }

    /// Time from layer to layer, s; the first is there at the start.
    pub fn layer_every(mut self, seconds: f64) -> Self {
        self.interval = seconds;
        self
    }

    /// Temperature of a layer when it is laid down, K.
    pub fn deposited_at(mut self, kelvin: f64) -> Self {
        self.temperature = kelvin;
        self
    }

    /// Holds a surface of the mesh at a temperature, K.
    pub fn hold(mut self, surface: &str, kelvin: f64) -> Self {
        self.held.push((surface.to_owned(), kelvin));
        self
    }

    /// Heat loss h (T − T_a) of the present outer surface, but where it is held: h in W/(m² K), T_a in K.
    pub fn convection(mut self, coefficient: f64, ambient: f64) -> Self {
        self.outer.push(Box::new(move |surface| Condition::Film {
            surface,
            coefficient: Schedule::constant(coefficient),
            ambient: Schedule::constant(ambient),
        }));
        self
    }

    /// Heat loss ε σ (T⁴ − T_a⁴) of the present outer surface, but where it is held: ε from 0 to 1, T_a in K.
    pub fn radiation(mut self, emissivity: f64, ambient: f64) -> Self {
        self.outer.push(Box::new(move |surface| Condition::Radiation {
            surface,
            emissivity,
            ambient: Schedule::constant(ambient),
        }));
        self
    }

    /// The problem, to which conditions and sources may be added.
    ///
    /// # Errors
    /// [`Error::Mesh`] for a surface that the mesh lacks, and for elements in no layer where there is no substrate;
    /// [`Error::Parameter`] for a time between layers that is not positive. [`Simulation::new`] checks the rest.
    pub fn problem(self) -> Result<Problem, Error> {
        let Self { mesh, layers, material, substrate, interval, temperature, held, outer } = self;
        if !(interval > 0.0 && interval.is_finite()) {
            let allowed = "above 0 s, finite".into();
            return Err(Error::Parameter { name: "time between layers", found: interval, allowed });
        }
        let mut material_of = vec![1; mesh.element_count()];
        layers.elements.iter().flatten().for_each(|&element| material_of[element as usize] = 0);
        let beside = material_of.iter().filter(|&&material| material == 1).count();
        let (mut materials, mut start) = (vec![material], temperature);
        match substrate {
            Some((material, temperature)) => {
                materials.push(material);
                start = temperature;
            }
            None if beside > 0 => {
                return Err(Error::Mesh(format!("{beside} elements are in no layer; allowed: a substrate")));
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
        conditions.extend(outer.iter().map(|condition| condition(Where::Outer { except: except.clone() })));
        let births = (0..).zip(layers.elements).map(|(layer, elements)| {
            let time = f64::from(layer) * interval;
            Birth { time, elements, temperature }
        });
        let births = births.collect();
        let whole = Problem::new(mesh, materials[0].clone(), start);
        Ok(Problem { materials, material_of, conditions, births, ..whole })
    }

    /// The part at the start of its print.
    ///
    /// # Errors
    /// As [`Self::problem`] and [`Simulation::new`].
    pub fn simulate(self, settings: Settings) -> Result<Simulation, Error> {
        Simulation::new(self.problem()?, settings)
    }
}
