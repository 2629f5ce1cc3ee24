//! Steps of a programme in sequence: each continues from the state at the end of the one before, with other
//! loads, another method, other cracks.

use super::fracture::Fracture;
use super::load::Loads;
use super::motion::{DynamicEnergies, Motion};
use super::state::State;
use super::step_control::StepControl;
use super::system::System;
use super::turned_sites::TurnedSites;
use crate::bonds::{BodyGeometry, Bonds};
use crate::error::Error;
use crate::field::Field;
use crate::geometry::Cut;
use serde::{Deserialize, Serialize};

/// Start of the present step of a programme.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct StepOrigin<const D: usize> {
    /// Steps finished.
    pub finished: usize,
    /// Time at the start, s.
    pub time: f64,
    /// Rows of the history at the start.
    pub rows: usize,
    /// Rows of the history at the start of each later step so far.
    pub starts: Vec<usize>,
    /// Displacement at the start, m; none in the first step.
    pub displacement: Option<Field<D>>,
    /// Body force density at the start, N/m³, if there was any.
    pub body_force: Option<Field<D>>,
    /// Sites turned about an axis so far.
    pub turned: Vec<TurnedSites>,
}

/// End of a step, beside the state, from which the next one continues.
#[derive(Clone, Debug, Default)]
pub struct StageEnd<const D: usize> {
    /// Body force density, N/m³, if there is any.
    pub body_force: Option<Field<D>>,
    /// Sites turned about an axis so far.
    pub turned: Vec<TurnedSites>,
}

impl<const D: usize> State<D> {
    /// Begins the next step, after one with this `end`, and severs the bonds across some cuts. Velocities
    /// stay if both steps are explicit dynamics (`moving`).
    pub fn begin_stage(&mut self, bonds: &dyn Bonds<D>, cuts: &[Cut<D>], end: StageEnd<D>, moving: bool) {
        let mut starts = std::mem::take(&mut self.stage.starts);
        starts.push(self.history.len());
        self.stage = StepOrigin {
            starts,
            finished: self.stage.finished + 1,
            time: self.history.last().map_or(0.0, |row| row.time),
            rows: self.history.len(),
            displacement: Some(self.displacement.clone()),
            body_force: end.body_force,
            turned: end.turned,
        };
        (self.step, self.counts.iteration, self.counts.step_iterations) = (0, 0, 0);
        // the heat of friction adds up until explicit dynamics begins a ledger of its own
        let energies = DynamicEnergies { rubbed: self.motion.energies.rubbed, ..DynamicEnergies::default() };
        (self.control, self.motion) = (StepControl::default(), Motion { energies, ..Motion::default() });
        self.contact.begin_stage();
        if !moving {
            self.velocity = Field::zeros(self.velocity.sites());
        }
        if !cuts.is_empty() {
            self.fracture.cut(bonds, cuts);
        }
        self.accept();
    }
}

impl Fracture {
    /// Severs the bonds across some cuts; returns their number. They count as neither broken nor released.
    pub fn cut<const D: usize>(&mut self, bonds: &dyn Bonds<D>, cuts: &[Cut<D>]) -> u64 {
        let words = self.intact.get_or_insert_with(|| bonds.intact());
        let mut count = 0;
        for &site in bonds.particles() {
            let here = bonds.position(site as usize);
            bonds.neighbours(site as usize, &mut |bond| {
                let there = bonds.position(bond.site);
                if cuts.iter().any(|cut| cut.severs(here, there)) {
                    let (word, bit) = bonds.bit(site as usize, bond.index);
                    words[word] &= !bit;
                    count += 1;
                }
            });
        }
        count / 2
    }
}

impl<const D: usize> Loads<D> {
    /// Lets loads that follow curves begin at the start of a step: displacements and rotations go from there
    /// to their values, former body forces fade as the load factor `common` grows.
    ///
    /// # Errors
    /// [`Error::Geometry`] for rotations that do not go on from the present place of their region, and for
    /// motions that begin with a jump.
    pub fn continue_from(
        &mut self,
        bonds: &dyn BodyGeometry<D>,
        stage: &StepOrigin<D>,
        common: &super::Amplitude,
    ) -> Result<(), Error> {
        self.continue_turned(bonds, stage, common)?;
        let Some(curved) = &mut self.curved else { return Ok(()) };
        let start =
            |site: u32| stage.displacement.as_ref().map_or([0.0; D], |field| field.get(site as usize));
        for region in &mut curved.held {
            region.offsets = region.sites.iter().map(|&site| start(site)).collect();
            for (value, offset) in region.values.iter_mut().zip(&region.offsets) {
                let kept = |d: usize| region.kept >> d & 1 == 1;
                *value = std::array::from_fn(|d| if kept(d) { 0.0 } else { value[d] - offset[d] });
            }
        }
        if let Some(force) = &stage.body_force {
            let each = (0..force.sites()).map(|site| (site as u32, force.get(site)));
            let (sites, values) = each.filter(|(_, value)| *value != [0.0; D]).unzip();
            let common = common.clone();
            let fading = super::Amplitude::new(move |part| (1.0 - common.multiple(part), -common.rate(part)));
            let amplitudes = std::array::from_fn(|_| fading.clone());
            curved.pushed.push(super::CurvedRegion::new(sites, values, amplitudes, 0));
            self.body_force.get_or_insert_with(|| Field::zeros(force.sites()));
        }
        self.set_peaks();
        self.set_turned_peaks(bonds);
        self.refuse_jumps(bonds, stage)
    }
}

impl<const D: usize> System<'_, D> {
    /// Returns the end of a step in the state there.
    pub fn end_of_step(&mut self, state: &State<D>) -> StageEnd<D> {
        let factor = state.history.last().map_or(0.0, |row| row.factor);
        self.set_forces(factor, &state.displacement);
        let turned = self.loads.turned_at_end(&*self.bonds, &state.stage, &state.displacement, factor);
        let factor = self.loads.force_factor(factor);
        let mut body_force = self.loads.body_force.clone();
        if let Some(force) = &mut body_force {
            for &site in self.bonds.particles() {
                force.set(site as usize, force.get(site as usize).map(|x| factor * x));
            }
        }
        StageEnd { body_force, turned }
    }
}
