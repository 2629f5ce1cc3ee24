//! Values of stress and warpage.

use super::probe::Probe;
use crate::coupling::StressCoupling;
use crate::program::quantities as q;
use harness::report::Report;

/// The scalars of the end, with the displacements of the probes that are in the part.
pub fn record(stress: &StressCoupling, probes: &[Probe], report: &mut Report) {
    let (largest, printed, balance) =
        (stress.largest_mises(), stress.mises_on_bed(), stress.energy_balance());
    let strength = stress.settings().law.strength;
    report.value(q::WARPAGE, stress.warpage());
    report.value(q::MISES_ON_BED, printed);
    report.value(q::MISES, largest);
    if strength.is_finite() {
        report.value(q::MISES_OVER_STRENGTH, printed.max(largest) / strength);
    }
    report.value(q::LARGEST_ROTATION, stress.largest_rotation());
    report.value(q::STRESS_WORK, balance.energies.work);
    report.value(q::STRESS_STORED, balance.energies.stored);
    report.value(q::STRESS_LOST, balance.energies.lost());
    report.value(q::STRESS_HARDENING, balance.energies.softening);
    report.value(q::WORST_STRESS_BALANCE, balance.worst);
    let moved = stress.displacement();
    for probe in probes {
        for (d, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let at = |node: u32| Some(moved[3 * node as usize + d]).filter(|x| !x.is_nan());
            if let Some(value) = probe.place().value(at) {
                report.value(q::DISPLACEMENT.of(&[probe.name(), axis]), value);
            }
        }
    }
    report.value(q::LARGEST_DISPLACEMENT, stress.largest_displacement());
    let [solutions, iterations] = stress.work();
    report.work("stress_steps", solutions).work("stress_iterations", iterations);
}
