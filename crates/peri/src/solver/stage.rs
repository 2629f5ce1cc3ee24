//! Steps of a programme in sequence: each continues from the state at the end of the one before, with other
//! loads, another method, other cracks.

use super::fracture::Fracture;
use super::load::Loads;
use super::motion::{DynamicEnergies, Motion};
use super::state::State;
use super::step_control::StepControl;
use super::system::System;
use crate::bonds::Bonds;
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
}

impl<const D: usize> State<D> {
    /// Begins the next step, after one that ended with `body_force`, N/m³, and severs the bonds across some
    /// cuts. Velocities stay if both steps are explicit dynamics (`moving`).
    pub fn begin_stage(
        &mut self,
        bonds: &dyn Bonds<D>,
        cuts: &[Cut<D>],
        body_force: Option<Field<D>>,
        moving: bool,
    ) {
        let mut starts = std::mem::take(&mut self.stage.starts);
        starts.push(self.history.len());
        self.stage = StepOrigin {
            starts,
            finished: self.stage.finished + 1,
            time: self.history.last().map_or(0.0, |row| row.time),
            rows: self.history.len(),
            displacement: Some(self.displacement.clone()),
            body_force,
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
    /// Lets loads that follow curves begin at the start of a step: displacements go from there to their
    /// values, former body forces fade as the load factor `common` grows.
    pub fn continue_from(&mut self, stage: &StepOrigin<D>, common: &super::Amplitude) {
        let Some(curved) = &mut self.curved else { return };
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
    }
}

impl<const D: usize> System<'_, D> {
    /// Body force density in a state at the end of a step, N/m³.
    pub fn body_force_at_end(&mut self, state: &State<D>) -> Option<Field<D>> {
        let factor = state.history.last().map_or(0.0, |row| row.factor);
        self.set_forces(factor, &state.displacement);
        let factor = self.loads.force_factor(factor);
        let mut force = self.loads.body_force.clone()?;
        for &site in self.bonds.particles() {
            force.set(site as usize, force.get(site as usize).map(|x| factor * x));
        }
        Some(force)
    }
}
