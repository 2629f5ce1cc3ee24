//! Physics of a variant: its body, material and loads, and the data that its outputs need.

use super::rows::{RowPart, rows};
use super::stage::SceneStage;
use crate::bonds::{Bonds, Property};
use crate::calibrate;
use crate::contact::{Contact, RigidSurface, SurfaceTraction};
use crate::correction::{bond_factors, surface_factors};
use crate::critical::{Context, CrackArea, Critical, Crossing, Toughness};
use crate::error::Error;
use crate::exact::Plate;
use crate::material::{BondMaterial, Material, Prestrained, SolverMaterial, relief};
use crate::potential::{BondPotential, BondSoftening};
use crate::probe::{AnySolid, LineSampler, StressEvaluator};
use crate::program::scene::{
    self, DiscreteBody, Inclusions, LimitOf, ParameterField, Scene, SceneVariant, SurfaceCorrection,
};
use crate::solver::{Criterion, Loads, State};
use harness::scene::{Failure, SceneError, Source};
use polycore::network::PolymerNetwork;
use std::sync::Arc;

/// Material of a scene.
pub enum SceneMaterial<const D: usize> {
    /// Bond law.
    Bonds(BondMaterial<'static>),
    /// Bond law with prestrains.
    Prestrained(Prestrained<D>),
    /// Solid of the mean deformation of a family.
    Solid(AnySolid<D>),
}

impl<const D: usize> SceneMaterial<D> {
    /// Returns the material as solvers use it.
    pub fn respond(&self, bonds: &dyn Bonds<D>) -> Box<dyn SolverMaterial<D>> {
        match self {
            Self::Bonds(bonded) => bonded.clone().respond(bonds),
            Self::Prestrained(prestrained) => prestrained.clone().respond(bonds),
            Self::Solid(solid) => solid.clone().respond(bonds),
        }
    }

    /// Returns the longitudinal modulus at rest, Pa.
    pub fn longitudinal_modulus(&self, bonds: &dyn Bonds<D>) -> f64 {
        match self {
            Self::Bonds(bonded) => bonded.longitudinal_modulus(bonds),
            Self::Prestrained(prestrained) => prestrained.longitudinal_modulus(bonds),
            Self::Solid(solid) => solid.longitudinal_modulus(bonds),
        }
    }

    /// Returns the stiffness at rest by the law of the particle in a site over that of the rest.
    pub fn relative_stiffness(&self, site: usize) -> f64 {
        match self {
            Self::Bonds(bonded) => Material::<D>::relative_stiffness(bonded, site),
            Self::Solid(solid) => solid.relative_stiffness(site),
            Self::Prestrained(_) => 1.0,
        }
    }

    /// Returns kθ of linear bonds of similar stiffness, N/m⁶.
    pub fn micromodulus(&self, bonds: &dyn Bonds<D>) -> f64 {
        match self {
            Self::Bonds(bonded) => bonded.modulus(),
            Self::Prestrained(prestrained) => prestrained.micromodulus(bonds),
            Self::Solid(solid) => solid.micromodulus(bonds),
        }
    }
}

/// Calibrated material in a body with surface and stiffness factors.
pub struct BodyWithMaterial<const D: usize> {
    /// Material.
    pub material: SceneMaterial<D>,
    /// Criterion of breaking, if bonds break.
    pub criterion: Option<Criterion>,
    /// Fracture energies of the critical stretch of a bond law.
    pub toughness: Option<Toughness>,
    /// Parameters that follow fields.
    pub followed: Vec<ParameterField>,
    /// Stiffness over that without inclusions.
    pub stiffness: Property,
    /// Bonds across each interface of the scene, by their sites.
    pub interfaces: Vec<Vec<[u32; 2]>>,
}

impl<const D: usize> BodyWithMaterial<D> {
    /// Calibrates and corrects a body.
    ///
    /// # Errors
    /// An invalid material.
    pub fn new(
        source: &Source,
        scene: &Scene,
        variant: &SceneVariant,
        body: &mut DiscreteBody<D>,
    ) -> Result<Self, Failure<Error>> {
        let (space, spec) = (scene.body.space, &scene.material);
        let (horizon, thickness) = (body.bonds.horizon(), body.thickness);
        let fault = |error| scene::limit_error(source, "material.critical", error);
        if spec.solid.is_some() {
            let (solid, inclusions) = scene::solid_of_parts(source, scene, body)?;
            let both = |critical: Critical, _| {
                critical.solid_criterion(&**solid.law(), &*body.bonds).map(|own| [own.onset(), own.least()])
            };
            let limits = |rest: f64, limit: LimitOf<f64>| {
                let limits = inclusions.limits(source, &*body.bonds, rest, limit)?;
                scene::limits_of_bonds(source, scene, body, limits, &1.0.into(), limit)
            };
            let rest = spec.critical.map_or(Ok([f64::INFINITY; 2]), |own| both(own, 1.0));
            let rest = rest.map_err(fault)?;
            let limit = || limits(rest[1], &|critical, stiffness| Ok(both(critical, stiffness)?[1]));
            let criterion = match scene.limits().next() {
                Some(Critical { stretch: Some(_), .. }) => Some(Criterion::Stretch(limit()?)),
                Some(Critical { strength: None, .. }) => Some(Criterion::Energy(limit()?)),
                Some(_) => {
                    let [onset, limit] = scene::softening_limits(&*body.bonds, rest, &both, &limits)?;
                    Some(Criterion::Softening { onset, limit })
                }
                None => None,
            };
            // of force scale and preconditioner: forces of solids have no factors
            let moduli = scene::relative_moduli(&solid, &*body.bonds);
            if let Some(factors) = bond_factors(&*body.bonds, None, &moduli) {
                body.bonds.set_factors(factors);
            }
            return Ok(Self {
                criterion,
                material: SceneMaterial::Solid(solid),
                toughness: None,
                followed: Vec::new(),
                stiffness: 1.0.into(),
                interfaces: body.interfaces.clone(),
            });
        }
        let law: Arc<dyn BondPotential> = Arc::from(spec.bond_law()?);
        let youngs_modulus = spec.youngs_modulus.map_or(f64::NAN, |modulus| modulus.si());
        let mut modulus = calibrate::modulus(space, youngs_modulus, horizon, thickness);
        if let Some(lattice) = body.bonds.as_lattice() {
            modulus *= calibrate::lattice_factor::<D>(spec.calibration, lattice);
        }
        let surface = (variant.surface == SurfaceCorrection::Energy).then(|| {
            surface_factors(&*body.bonds, modulus, calibrate::stiffness_1111(space, youngs_modulus))
        });
        let crossing = scene.breaks().then(|| Crossing::new(&*body.bonds, surface.as_ref()));
        let followed = scene::followed(source, scene, body)?;
        let inclusions = Inclusions::new(source, scene, body, &followed)?;
        if let Some(factors) = bond_factors(&*body.bonds, surface, &inclusions.micromodulus) {
            body.bonds.set_factors(factors);
        }
        let context = |stiffness: f64, crossing: Crossing| {
            let (links, modulus) = (spec.links, stiffness * modulus);
            let convention = scene.convention().unwrap_or_default();
            let softening = BondSoftening::default();
            Context { law: &*law, links, space, modulus, horizon, thickness, crossing, convention, softening }
        };
        let (mut criterion, mut toughness): (Option<Criterion>, _) = (None, None);
        let (mut softening, mut onset) = (BondSoftening::default(), None);
        if let Some(crossing) = crossing {
            let mut stretch = f64::INFINITY;
            if let Some(critical) = &spec.critical {
                let mut rest = context(1.0, crossing);
                rest.softening = critical.softening(&rest).map_err(fault)?;
                stretch = critical.resolve(&rest).map_err(fault)?;
                softening = rest.softening;
                toughness = Some(Toughness::new(critical, &rest, stretch));
            }
            let kink = spec.critical.and_then(|critical| critical.kink);
            let both = |critical: Critical, stiffness| {
                let mut context = context(stiffness, crossing);
                context.softening.kink = kink;
                Critical { kink, ..critical }.softened(&mut context)
            };
            let limits = |rest: f64, limit: LimitOf<f64>| {
                let limits = inclusions.limits(source, &*body.bonds, rest, limit)?;
                scene::limits_of_bonds(source, scene, body, limits, &inclusions.micromodulus, limit)
            };
            criterion = Some(if scene.has_strength() {
                let first = if stretch.is_finite() { softening.onset(stretch) } else { stretch };
                let [starts, ends] = scene::softening_limits(&*body.bonds, [first, stretch], &both, &limits)?;
                onset =
                    Some(starts).filter(|starts| [starts, &ends].iter().any(|own| own.uniform().is_none()));
                ends.into()
            } else {
                limits(stretch, &|critical, stiffness| Ok(both(critical, stiffness)?[1]))?.into()
            });
        }
        let mut bonded = BondMaterial::new(law, modulus);
        if scene.softens()
            && let Some(Criterion::Stretch(end)) = &criterion
        {
            bonded = bonded.softening(softening, end.clone(), onset)?;
        }
        if let Some((laws, shares)) = scene::laws_of_parts(scene, &*body.bonds, &inclusions)? {
            bonded = bonded.with_parts(laws, shares)?;
            // of the law of the rest alone
            toughness = None;
        }
        let material = match inclusions.prestrain {
            Some(strain) => {
                let prestrained = Prestrained::new(bonded, strain);
                SceneMaterial::Prestrained(match &criterion {
                    Some(criterion) => prestrained.clamped(criterion.most()),
                    None => prestrained,
                })
            }
            None => SceneMaterial::Bonds(bonded),
        };
        let (stiffness, interfaces) = (inclusions.micromodulus, body.interfaces.clone());
        Ok(Self { material, criterion, toughness, followed, stiffness, interfaces })
    }
}

/// Physics of a variant, without its body.
pub struct Physics<const D: usize> {
    /// Name of the variant in file names.
    pub name: String,
    /// Material in the body.
    pub body: BodyWithMaterial<D>,
    /// Loads and supports.
    pub loads: Loads<D>,
    /// Later steps.
    pub stages: Vec<SceneStage<D>>,
    /// Sites on which a load or support acts.
    pub loaded: Vec<bool>,
    /// Grips that are tied at their surface, by site.
    pub held: Option<Vec<bool>>,
    /// Planes and indenters of `[contact]`.
    pub surfaces: Vec<RigidSurface<D>>,
    /// The same where they begin: with a force at first touch.
    pub placed: Vec<RigidSurface<D>>,
    /// With `output.contact`, the contact of the present step beside the undeformed body.
    touching: Option<Contact<D>>,
    rows: Vec<RowPart<D>>,
    /// Evaluator of forces and stresses; this and the following fields are set by [`Self::begin`].
    pub evaluator: StressEvaluator<D>,
    /// Bonds of each particle without cracks, and the bonds that cracks break; only with cracks or breaking
    /// bonds.
    pub whole: Option<[Vec<u32>; 2]>,
    /// Network of `material.network`.
    pub network: Option<PolymerNetwork>,
    /// Area of new cracks, if bonds break.
    pub cracks: Option<CrackArea>,
    /// Tearing energy, J/m²; `None` for a solid with a critical stretch.
    pub tearing: Option<f64>,
    /// Exact stresses of the plate of `[exact]`.
    pub plate: Option<Plate>,
    /// Sites at which stress measures compensate for missing bonds by the window's share in the body: where
    /// forces act, or where the surface correction already compensates.
    pub by_window: Vec<bool>,
}

impl<const D: usize> Physics<D> {
    /// Builds the body of a variant, its material, its loads, and the rows of its history.
    ///
    /// # Errors
    /// An invalid scene.
    pub fn new(
        source: &Source,
        scene: &Scene,
        variant: &SceneVariant,
    ) -> Result<(DiscreteBody<D>, Self), Failure<Error>> {
        let mut body = scene::body_of::<D>(source, scene, variant)?;
        // before the loads: tractions act on the relieved areas
        if scene.material.solid.is_some()
            && let Some(theta) = relief(&*body.bonds)
        {
            body.bonds.set_relief(theta);
        }
        let (mut loads, loaded) = scene::loads_of(source, scene, &body)?;
        let stages = SceneStage::all(source, scene, &body, &mut loads)?;
        scene::check_placement(source, scene, &body, &loads)?;
        let held = scene::tied_grips(source, scene, &*body.bonds, &loads)?;
        if let Some(held) = &held {
            let list = crate::contact::across(&*body.bonds, held);
            body.bonds.break_bonds(&list);
        }
        let surfaces = scene.contact.as_ref().map(|contact| contact.surfaces(source, scene)).transpose()?;
        let rows = rows(source, scene, &body)?;
        check_lines(source, scene, &*body.bonds)?;
        let with = BodyWithMaterial::new(source, scene, variant, &mut body)?;
        let network = scene.material.network.as_ref();
        let physics = Self {
            network: network.map(|network| network.network(source)).transpose()?,
            name: String::new(),
            body: with,
            loads,
            stages,
            loaded,
            held,
            surfaces: surfaces.unwrap_or_default(),
            placed: Vec::new(),
            touching: None,
            rows,
            evaluator: StressEvaluator::none(),
            whole: None,
            cracks: None,
            tearing: None,
            plate: None,
            by_window: Vec::new(),
        };
        Ok((body, physics))
    }

    /// Records the data of the undeformed body that outputs need.
    ///
    /// # Errors
    /// A hole of `[exact]` that does not fit into the plate.
    pub fn begin(
        &mut self,
        source: &Source,
        scene: &Scene,
        variant: &SceneVariant,
        body: &DiscreteBody<D>,
    ) -> Result<(), SceneError> {
        let (bonds, own) = (&*body.bonds, &self.body);
        let breaks = own.criterion.is_some();
        self.plate = scene::exact_plate(source, scene, body)?;
        self.evaluator = match &own.material {
            SceneMaterial::Bonds(material) => {
                StressEvaluator::for_bonds(material.clone(), scene.fit_bound(), breaks)
            }
            SceneMaterial::Solid(solid) if scene.observes_forces() => {
                StressEvaluator::for_solid(solid.clone(), scene.is_learnt(), bonds)
            }
            _ => StressEvaluator::none(),
        };
        self.whole = (breaks || !body.cuts.is_empty()).then(|| {
            let cracked = scene::severed_of_each(bonds, &body.cuts);
            let left = bonds.particles().iter().map(|&site| bonds.bonded(site as usize));
            [left.zip(&cracked).map(|(left, cracked)| left + cracked).collect(), cracked]
        });
        // parts of a solid with limits of their own have no common energy
        let common = scene.material.inclusions.iter().all(|part| part.critical.is_none());
        let given = scene.material.critical.filter(|_| common).and_then(|critical| critical.fracture_energy);
        let toughness = own.toughness.as_ref();
        self.tearing = toughness.map(|own| own.tearing).or(given.map(|energy| energy.si()));
        self.cracks = breaks.then(|| {
            CrackArea::new(bonds, &toughness.map_or_else(|| Crossing::new(bonds, None), |own| own.crossing))
        });
        let corrected = variant.surface == SurfaceCorrection::Energy;
        self.by_window = self.loaded.iter().map(|&loaded| loaded || corrected).collect();
        Ok(())
    }

    /// Builds the contact of a body that is whole.
    ///
    /// # Errors
    /// As [`Contact::with_surfaces`].
    pub fn contact(&self, scene: &Scene, body: &DiscreteBody<D>) -> Result<Option<Contact<D>>, Error> {
        let Some(spec) = &scene.contact else { return Ok(None) };
        let (material, bonds) = (&self.body.material, &*body.bonds);
        let whole = material.longitudinal_modulus(bonds);
        let stiffness = |site| self.body.stiffness.value_at(site) * material.relative_stiffness(site);
        let modulus = Property::new(bonds, |site, _| whole * stiffness(site));
        let held = self.held.as_deref();
        let tied = held.map(|held| (held, spec.tie_stiffness(scene.dynamics.is_some())));
        let contact =
            spec.contact(self.surfaces.clone(), body, material.micromodulus(bonds), &modulus, tied)?;
        Ok(Some(contact))
    }

    /// Places the rigid surfaces of a contact beside a whole body for the outputs of a step.
    pub fn place_surfaces(&mut self, scene: &Scene, contact: Option<&Contact<D>>) {
        self.placed = contact.into_iter().flat_map(Contact::surfaces).cloned().collect();
        self.touching = contact.filter(|_| scene.output.contact).cloned();
    }

    /// Returns the tractions of contact in a state; none without `output.contact`.
    pub fn tractions(
        &self,
        scene: &Scene,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
    ) -> Vec<SurfaceTraction<D>> {
        let touching = self.touching.as_ref();
        touching.map_or_else(Vec::new, |contact| state.tractions(contact, bonds, &scene.load_steps().0))
    }

    /// Returns the numbers of a row of the history: probes, flags of a learnt law, sections.
    pub fn row(&self, bonds: &dyn Bonds<D>, state: &State<D>) -> Vec<f64> {
        self.rows.iter().flat_map(|part| part(bonds, state, &self.evaluator)).collect()
    }

    /// Returns the name of the field file.
    pub fn field_file(&self) -> String {
        format!("{}.vtkhdf", self.name)
    }
}

/// Refuses lines without any point in the body.
///
/// # Errors
/// A [`SceneError`] that names the line.
fn check_lines<const D: usize>(
    source: &Source,
    scene: &Scene,
    bonds: &dyn Bonds<D>,
) -> Result<(), SceneError> {
    for (index, line) in scene.output.line.iter().enumerate() {
        let places = line.places::<D>();
        let around = LineSampler::new(bonds, &[], [places[0], places[places.len() - 1]]);
        let inside = places.iter().any(|at| around.weights(*at).is_some());
        line.refuse_outside(source, index, inside)?;
    }
    Ok(())
}
