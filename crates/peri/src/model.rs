//! Models in a few lines: a [`Body`], a material and loads make a [`Simulation`], which any [`Method`]
//! solves.

mod body;
mod rubber;
mod solid;

pub use body::Body;
pub use rubber::{CompositeRubber, Rubber};

use crate::bonds::{BodyGeometry, LatticeBonds, Property, covered_stretches, fragments};
use crate::contact::{Contact, RigidSurface};
use crate::error::Error;
use crate::material::{BondMaterial, Material};
use crate::probe::StressEvaluator;
use crate::solver::{
    Breaking, Loads, Method, Policy, RotatingRegion, Rotation, State, Status, StepRecord, Support, System,
};
use crate::stress::{
    self, BallVolume, BondFits, StressInput, StressMethod, StressTensor, SurfaceCompensation,
};

/// A material of a body: a [`Material`], or a description that becomes one in a body, such as [`Rubber`] or a
/// [`Correspondence`](crate::material::Correspondence).
pub trait IntoMaterial<const D: usize> {
    /// Resulting material.
    type Material: Material<D> + Clone;

    /// Builds the material in a body, and the critical stretch of its bonds if they break.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of its domain.
    fn into_material(
        self,
        body: &Body<D>,
        bonds: &LatticeBonds<D>,
    ) -> Result<(Self::Material, Option<f64>), Error>;
}

impl<const D: usize, M: Material<D> + Clone> IntoMaterial<D> for M {
    type Material = M;

    fn into_material(self, _: &Body<D>, _: &LatticeBonds<D>) -> Result<(M, Option<f64>), Error> {
        Ok((self, None))
    }
}

/// Selects the points X, m, that belong to a region.
type RegionTest<const D: usize> = Box<dyn Fn(&[[f64; D]]) -> Result<Vec<bool>, Error>>;

/// A body, its material and its loads, before anything is built.
///
/// A region is a function of the reference position: `|[x, _]| x < 3e-3` contains every particle with X₁
/// below 3 mm.
pub struct Model<const D: usize, M> {
    body: Body<D>,
    material: M,
    regions: Vec<(RegionTest<D>, Support<D>)>,
    /// Rotating regions, by their numbers.
    rotations: Vec<(usize, Rotation<D>)>,
    factors: Vec<f64>,
    times: Vec<f64>,
    critical_stretch: Option<Property>,
    contact: Option<f64>,
    surfaces: Vec<RigidSurface<D>>,
}

impl<const D: usize, M: IntoMaterial<D>> Model<D, M> {
    /// Creates a body without loads: one load step, no breaking unless the material defines it, no contact.
    pub fn new(body: Body<D>, material: M) -> Self {
        Self {
            body,
            material,
            regions: Vec::new(),
            rotations: Vec::new(),
            factors: vec![1.0],
            times: Vec::new(),
            critical_stretch: None,
            contact: None,
            surfaces: Vec::new(),
        }
    }

    /// Fixes all components of a region.
    pub fn clamp(self, region: impl Fn([f64; D]) -> bool + 'static) -> Self {
        self.displace(region, [0.0; D])
    }

    /// Moves a region by a displacement, m, at load factor 1. If regions overlap, the last one counts.
    pub fn displace(self, region: impl Fn([f64; D]) -> bool + 'static, displacement: [f64; D]) -> Self {
        self.support(region, Support { displacement: displacement.map(Some), body_force: [0.0; D] })
    }

    /// Rotates a region about an axis, along the arc: by the whole angle at load factor 1. No other region
    /// with prescribed displacement may overlap a rotating one.
    pub fn rotate(mut self, region: impl Fn([f64; D]) -> bool + 'static, rotation: Rotation<D>) -> Self {
        self.rotations.push((self.regions.len(), rotation));
        self.displace(region, [0.0; D])
    }

    /// Loads a region by a body force, N/m³, at load factor 1. Forces add up.
    pub fn body_force(self, region: impl Fn([f64; D]) -> bool + 'static, force: [f64; D]) -> Self {
        self.support(region, Support { displacement: [None; D], body_force: force })
    }

    /// Prescribes some components of the displacement of a region, and a body force.
    pub fn support(self, region: impl Fn([f64; D]) -> bool + 'static, support: Support<D>) -> Self {
        self.support_where(move |points| Ok(points.iter().map(|&point| region(point)).collect()), support)
    }

    /// Prescribes a support as [`Self::support`], for a region that sees all particles at once, in the order
    /// of [`Simulation::displacements`], and returns a mark for each.
    pub fn support_where(
        mut self,
        region: impl Fn(&[[f64; D]]) -> Result<Vec<bool>, Error> + 'static,
        support: Support<D>,
    ) -> Self {
        self.regions.push((Box::new(region), support));
        self
    }

    /// Applies the loads in equal steps.
    pub fn steps(mut self, steps: usize) -> Self {
        self.factors = (1..=steps).map(|step| step as f64 / steps as f64).collect();
        self
    }

    /// Follows a programme of times, s, and load factors at the ends of steps, for a material with a state.
    pub fn programme(mut self, steps: impl IntoIterator<Item = [f64; 2]>) -> Self {
        (self.times, self.factors) = steps.into_iter().map(|[time, factor]| (time, factor)).unzip();
        self
    }

    /// Breaks bonds at a stretch, a number or a field over the particles, whatever the material defines.
    pub fn critical_stretch(mut self, stretch: impl Into<Property>) -> Self {
        self.critical_stretch = Some(stretch.into());
        self
    }

    /// Makes particles without a bond repel each other with the stiffness s of [`Contact::new`]; a good value
    /// is [`PAIR_STIFFNESS`](crate::contact::PAIR_STIFFNESS).
    pub fn contact(mut self, stiffness: f64) -> Self {
        self.contact = Some(stiffness);
        self
    }

    /// Adds a rigid surface that the body cannot pass, or a plane to which it is tied. Explicit dynamics
    /// takes larger steps with a [`RigidSurface::stiffness`] of 2.
    pub fn rigid_surface(mut self, surface: RigidSurface<D>) -> Self {
        self.surfaces.push(surface);
        self
    }

    /// Builds particles, bonds, material and loads.
    ///
    /// # Errors
    /// [`Error::Geometry`] for a body or a region without particles; [`Error::Parameter`] for a parameter of
    /// the material or of contact out of its domain.
    pub fn build(self) -> Result<Simulation<D, M::Material>, Error> {
        let bonds = self.body.build()?;
        let (material, critical) = self.material.into_material(&self.body, &bonds)?;
        let mut regions = Vec::new();
        let mut loaded = vec![false; bonds.sites()];
        let points: Vec<[f64; D]> =
            bonds.particles().iter().map(|&site| bonds.position(site as usize)).collect();
        for (number, (region, support)) in self.regions.into_iter().enumerate() {
            let inside = region(&points)?;
            if inside.len() != points.len() {
                let (found, allowed) = (inside.len(), points.len());
                return Err(Error::geometry(format!(
                    "region {} of the loads: found {found} answers; allowed: {allowed}, one for each \
                    particle",
                    number + 1
                )));
            }
            let sites = bonds.particles().iter().zip(inside);
            let members: Vec<u32> = sites.filter(|(_, inside)| *inside).map(|(&site, _)| site).collect();
            if members.is_empty() {
                return Err(Error::geometry(format!("region {} of the loads has no particle", number + 1)));
            }
            members.iter().for_each(|&site| loaded[site as usize] = true);
            regions.push((members, support));
        }
        let mut loads = Loads::new(bonds.sites(), &regions);
        let holds = |support: &Support<D>| support.displacement.iter().any(Option::is_some);
        for (number, rotation) in self.rotations {
            let region = regions[..number].iter().filter(|(_, support)| holds(support)).count();
            let (shift, components, sites) = ([0.0; D], (1 << D) - 1, regions[number].0.clone());
            loads.turn(
                &bonds,
                RotatingRegion {
                    rotation,
                    shift,
                    amplitudes: None,
                    components,
                    kept: 0,
                    region,
                    sites,
                    start: None,
                },
            );
        }
        let contact = match (self.contact, self.surfaces.is_empty()) {
            (None, true) => None,
            (stiffness, _) => {
                let whole = material.longitudinal_modulus(&bonds);
                let modulus = Property::new(&bonds, |site, _| whole * material.relative_stiffness(site));
                let surface = self.body.surface();
                let contact = Contact::new(&bonds, modulus.clone(), stiffness.unwrap_or(0.0))?;
                Some(contact.with_surfaces(&bonds, &surface, modulus, self.surfaces)?)
            }
        };
        let stretch = self.critical_stretch.or(critical.map(Property::from));
        let breaking =
            stretch.map(|stretch| Breaking { criterion: stretch.into(), policy: Policy::default() });
        let state = State::new(bonds.sites());
        let (factors, times) = (self.factors, self.times);
        Ok(Simulation { bonds, material, loads, loaded, factors, times, breaking, contact, state })
    }
}

/// A model with its particles and its state.
pub struct Simulation<const D: usize, M> {
    /// Particles and intact bonds.
    pub bonds: LatticeBonds<D>,
    /// Present state. Its velocity may be set before a dynamic solution.
    pub state: State<D>,
    /// Load factor at the end of each step; more may be added for the next call of [`Self::solve`]. Not used
    /// in dynamics.
    pub factors: Vec<f64>,
    /// Time at the end of each step, s, see [`Model::programme`]; empty: steps take no time.
    pub times: Vec<f64>,
    material: M,
    loads: Loads<D>,
    /// True for sites with loads.
    loaded: Vec<bool>,
    breaking: Option<Breaking>,
    contact: Option<Contact<D>>,
}

impl<const D: usize, M: Material<D> + Clone> Simulation<D, M> {
    /// Solves the remaining load steps, or continues to the end time of a dynamic method.
    ///
    /// # Errors
    /// Errors of the method: [`Error::NotConverged`], [`Error::NotFinite`], [`Error::Unstable`] and others.
    pub fn solve(&mut self, method: impl Method<D>) -> Result<(), Error> {
        self.solve_with(method, |_| Ok(()))
    }

    /// Solves as [`Self::solve`] does; `finished` receives the state after every load step, equilibrium in
    /// which bonds broke or row of a dynamic history, and may stop the solution by an error.
    ///
    /// # Errors
    /// Errors of [`Self::solve`] and of `finished`.
    pub fn solve_with(
        &mut self,
        method: impl Method<D>,
        finished: impl FnMut(&State<D>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.solve_watched(method, |_| Ok(()), finished)
    }

    /// Solves as [`Self::solve_with`] does; `watch` receives every iteration and may also stop the solution
    /// by an error.
    ///
    /// # Errors
    /// Errors of [`Self::solve_with`] and of `watch`.
    pub fn solve_watched(
        &mut self,
        method: impl Method<D>,
        mut watch: impl FnMut(&Status) -> Result<(), Error>,
        mut finished: impl FnMut(&State<D>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut system = System::new(&mut self.bonds, self.material.clone(), &self.loads, &self.factors);
        system.breaking.clone_from(&self.breaking);
        system.times = (&self.times).into();
        system.contact = self.contact.take();
        let mut seen = |status: &Status, _: &State<D>| watch(status);
        let solved = method.solve(&mut system, &mut self.state, &mut seen, &mut |_, state| finished(state));
        self.contact = system.contact.take();
        solved
    }

    /// Finished load steps, or the rows of a dynamic history.
    pub fn history(&self) -> &[StepRecord] {
        &self.state.history
    }

    /// Position X and displacement u of every particle, m.
    pub fn displacements(&self) -> impl Iterator<Item = ([f64; D], [f64; D])> {
        let particles = self.bonds.particles().iter().map(|&site| site as usize);
        particles.map(|site| (self.bonds.position(site), self.state.displacement.get(site)))
    }

    /// Number of pieces that the body has broken into.
    pub fn fragments(&self) -> usize {
        fragments(&self.bonds).len()
    }
}

impl<const D: usize> Simulation<D, BondMaterial<'static>> {
    /// Creates an evaluator of bond forces, see [`crate::probe`].
    pub fn evaluator(&self) -> StressEvaluator<D> {
        StressEvaluator::for_bonds(self.material.clone(), 1e-9, self.breaking.is_some())
    }
}

impl<const D: usize> Simulation<D, BondMaterial<'_>> {
    /// First Piola–Kirchhoff stress P of every particle, Pa, in the order of [`Self::displacements`].
    ///
    /// # Errors
    /// As [`BondMaterial::fits`].
    pub fn piola(&self, measure: StressMethod) -> Result<Vec<StressTensor<D>>, Error> {
        let displacement = &self.state.displacement;
        let fits = self.material.fits(covered_stretches(&self.bonds, displacement), 1e-9)?;
        let (modulus, missing) = (self.material.modulus(), SurfaceCompensation::WindowAt(&self.loaded));
        let fit = BondFits::new(&fits, self.material.shares(), self.bonds.sites())?;
        let loaded = StressInput { displacement, fit, modulus, missing };
        Ok(stress::piola(&self.bonds, &loaded, measure, BallVolume::default()))
    }

    /// Cauchy stress σ = P Fᵀ/J of every particle, Pa, in the order of [`Self::displacements`].
    ///
    /// # Errors
    /// As [`Self::piola`].
    pub fn cauchy(&self, measure: StressMethod) -> Result<Vec<StressTensor<D>>, Error> {
        let gradients = stress::deformation_gradients(&self.bonds, &self.state.displacement);
        Ok(stress::cauchy(&self.piola(measure)?, &gradients))
    }
}
