//! Plausibility checks of test data: signs, mislabelled strains, the tail of a broken specimen.

use super::columns::StrainMeasure;
use super::data::Mode;

/// Row of a table with one stress or two.
#[derive(Debug, Clone, Copy)]
pub(super) struct TestRow {
    pub index: usize,
    pub mode: Mode,
    /// True for a test labelled as compression.
    pub compression: bool,
    /// Strains as written, without their unit.
    pub written: [f64; 2],
    pub stretches: [f64; 2],
    pub nominal: [f64; 2],
    /// Roots of the weights.
    pub roots: [f64; 2],
}

/// Share of the largest stress below which stresses are noise around zero.
pub(super) const NOISE_LEVEL: f64 = 0.02;
/// Strain without a unit beyond which it must be in per cent: rubbers break earlier.
const LARGEST_STRAIN: f64 = 20.0;
/// Share of the largest stress to which the stress of a torn specimen falls.
const TORN_STRESS: f64 = 0.7;
/// Share of the strain at the largest stress below which a specimen is unloaded, not torn.
const UNLOADED_STRAIN: f64 = 0.95;

/// Changes the sign of compressive stresses that are positive, and removes rows after the break of a
/// specimen.
///
/// # Errors
/// A row, and the content allowed there: strains that are stretches or in per cent, stretches that are
/// strains, stresses against the strain.
pub(super) fn plausible(
    rows: &mut Vec<TestRow>,
    notes: &mut Vec<String>,
    measure: StrainMeasure,
    said: bool,
    has_unit: bool,
) -> Result<(), (usize, String)> {
    let largest = rows.iter().map(|row| row.nominal[0].abs()).fold(0.0, f64::max);
    let strain = measure != StrainMeasure::Stretch;
    let far = rows.iter().find(|row| strain && !has_unit && row.written[0].abs() > LARGEST_STRAIN);
    if let Some(row) = far {
        let allowed = "a strain below 20, i.e. 2000 %; for per cent use the heading `strain [%]`";
        return Err((row.index, allowed.to_owned()));
    }
    if strain && !said && !has_unit && look_like_stretches(rows, largest) {
        let allowed = "a strain, 0 at rest; these are 1 at zero stress: is this a stretch? Use the heading \
                       `stretch`, or write `strain = \"stretch\"`";
        return Err((rows[0].index, allowed.to_owned()));
    }
    let counts = |row: &&TestRow| {
        row.nominal[0].abs() > NOISE_LEVEL * largest && (row.stretches[0] - 1.0).abs() > 1e-3
    };
    let measured: Vec<TestRow> = rows.iter().filter(counts).copied().collect();
    let against: Vec<&TestRow> =
        measured.iter().filter(|row| (row.stretches[0] - 1.0) * row.nominal[0] < 0.0).collect();
    if against.len() * 5 > measured.len() {
        let row = *against[0];
        let positive = |row: &TestRow| row.nominal[0] > 0.0;
        let squeezed = measured.iter().all(|row| positive(row) && row.stretches[0] < 1.0);
        // a strain grows with its stress, a stretch below 1 falls
        let rising = slope(&measured) > 0.0;
        if squeezed && !(measure == StrainMeasure::Stretch && rising) {
            rows.iter_mut().for_each(|row| row.nominal[0] = 0.0 - row.nominal[0]);
            notes.push("stresses in compression, positive in the file, become negative".to_owned());
        } else if measure == StrainMeasure::Stretch && against.iter().all(|row| positive(row)) {
            let allowed = "a stretch, 1 at rest, whose stress is negative below 1; is this a strain? Use \
                           the heading \
                           `strain`, or write `strain = \"engineering\"`";
            return Err((row.index, allowed.to_owned()));
        } else {
            let (stress, stretch) = (row.nominal[0], row.stretches[0]);
            let allowed = format!(
                "a stress with the sign of the strain (the stiffness would be negative: {stress} Pa at the \
                 stretch {stretch}); in compression both are negative"
            );
            return Err((row.index, allowed));
        }
    }
    for mode in Mode::TESTS {
        remove_tails(rows, notes, mode);
    }
    Ok(())
}

/// Returns true if the strains look like stretches: around 1 the stress is about 0, and none is near 0.
fn look_like_stretches(rows: &[TestRow], largest: f64) -> bool {
    let at_rest =
        |row: &TestRow| (row.written[0] - 1.0).abs() < 0.02 && row.nominal[0].abs() <= NOISE_LEVEL * largest;
    rows.iter().any(at_rest)
        && rows.iter().all(|row| row.written[0] > 0.3)
        && rows.iter().any(|row| row.written[0] > 1.02 || row.written[0] < 0.98)
}

/// Covariance of stretch and stress.
fn slope(rows: &[TestRow]) -> f64 {
    let count = rows.len().max(1) as f64;
    let mean = |of: fn(&TestRow) -> f64| rows.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|row| row.stretches[0]), mean(|row| row.nominal[0]));
    rows.iter().map(|row| (row.stretches[0] - x) * (row.nominal[0] - y)).sum()
}

/// Removes rows after the largest stress of each specimen in tension, if the stress falls and the specimen is
/// not unloaded.
fn remove_tails(rows: &mut Vec<TestRow>, notes: &mut Vec<String>, mode: Mode) {
    let places: Vec<usize> = (0..rows.len()).filter(|&i| rows[i].mode == mode).collect();
    let strain = |i: usize| rows[i].stretches[0] - 1.0;
    let mut lost = Vec::new();
    let mut begin = 0;
    while begin < places.len() {
        // up to where the next specimen begins: at less than half of the strain reached so far
        let mut reached = 0.0_f64;
        let next = (begin..places.len()).find(|&k| {
            let found = strain(places[k]);
            let back = reached > 0.0 && found < 0.5 * reached;
            reached = reached.max(found);
            back
        });
        let end = next.unwrap_or(places.len());
        let specimen = &places[begin..end];
        let peak =
            specimen.iter().copied().max_by(|&a, &b| rows[a].nominal[0].total_cmp(&rows[b].nominal[0]));
        if let Some(peak) = peak {
            let most = rows[peak].nominal[0];
            let torn = |&i: &usize| {
                rows[i].nominal[0] < TORN_STRESS * most && strain(i) > UNLOADED_STRAIN * strain(peak)
            };
            let tail: Vec<usize> = specimen.iter().copied().filter(|&i| i > peak).collect();
            if most > 0.0 && strain(peak) > 0.0 && tail.iter().any(torn) {
                lost.extend(tail);
            }
        }
        begin = end;
    }
    if let (Some(first), count) = (lost.first(), lost.len()) {
        notes.push(format!(
            "warning: {count} row{} after the largest stress left out, from the stretch {:.4} on: the stress \
             falls as in a broken specimen",
            if count == 1 { "" } else { "s" },
            rows[*first].stretches[0]
        ));
    }
    let mut kept = vec![true; rows.len()];
    lost.iter().for_each(|&i| kept[i] = false);
    let mut kept = kept.into_iter();
    rows.retain(|_| kept.next().unwrap_or(true));
}
