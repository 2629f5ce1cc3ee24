//! What a scene makes of a G-code file: its filament, its times, what of it is part of the body.

use super::fault::located_in;
use crate::mesh::path::{FAMILIES, FILAMENT, ToolPath};
use harness::scene::{SceneError, Source};
use polycore::units::{Acceleration, Length, Speed};

/// Where parameters stand in their block.
const KEYS: [(&str, &str); 2] = [("acceleration", "acceleration"), ("jerk", "jerk")];
/// Diameters that are one.
const SAME: f64 = 1e-3;
/// Share of the filament that may be where nothing is printed.
const LOOSE: f64 = 0.1;

/// Diameter of the filament, m: of the scene, of the file, or the usual one.
pub(super) fn filament(
    source: &Source,
    block: &str,
    path: &ToolPath,
    given: Option<Length>,
) -> Result<f64, SceneError> {
    let given = given.map(|x| x.si());
    if let (Some(own), Some(stated), true) = (given, path.filament, path.volumetric)
        && (own / stated - 1.0).abs() > SAME
    {
        let allowed =
            format!("{} mm or nothing: E of the file is a volume (M200) of this diameter", 1e3 * stated);
        return Err(source.error(&format!("{block}.filament"), format!("{} mm", 1e3 * own), allowed));
    }
    Ok(given.or(path.filament).unwrap_or(FILAMENT))
}

/// The path with its times: by the limits of the scene, or of the file, or at F; and how that compares with
/// the slicer's estimate.
pub(super) fn timed(
    source: &Source,
    block: &str,
    path: ToolPath,
    acceleration: Option<Acceleration>,
    jerk: Option<Speed>,
    notes: &mut Vec<String>,
) -> Result<ToolPath, SceneError> {
    let (path, with) = match (acceleration, jerk) {
        (None, None) => {
            match path.describe_limits() {
                Some(limits) => {
                    notes.push(format!(
                        "times by the limits that the file states: {limits}; waits for temperatures left out"
                    ));
                    (path.with_stated_limits(), "with the limits that the file states")
                }
                None => {
                    notes.push("times at F: the file states no limits of acceleration; waits for temperatures left out".into());
                    (path, "at F")
                }
            }
        }
        (Some(acceleration), Some(jerk)) => {
            let path = path.with_acceleration(acceleration.si(), jerk.si());
            (path.map_err(|error| located_in(source, block, &KEYS, &error))?, "with the limits of the scene")
        }
        (given, _) => {
            let missing = if given.is_some() { "jerk" } else { "acceleration" };
            return Err(source.error(
                &format!("{block}.{missing}"),
                "nothing",
                "`acceleration` and `jerk`, or neither",
            ));
        }
    };
    notes.extend(path.compare_estimate(with));
    Ok(path)
}

/// The path without what lies on nothing, as purges at z = 0 do.
pub(super) fn purged(
    source: &Source,
    key: &str,
    mut path: ToolPath,
    notes: &mut Vec<String>,
) -> Result<ToolPath, SceneError> {
    if let Some((count, line, share)) = path.remove_loose() {
        let told = format!(
            "{count} printing moves have no room above the bed (z ≤ 0) or fall through the air, the first in line {line}: {:.2} % of the filament",
            100.0 * share
        );
        if share > LOOSE {
            return Err(source.error(key, told, "beads above the bed at z = 0"));
        }
        notes.push(format!("{told}, left out"));
    }
    Ok(path)
}

/// Takes features out of the part.
pub(super) fn leave_out(
    source: &Source,
    block: &str,
    names: &[String],
    path: &mut ToolPath,
    notes: &mut Vec<String>,
) -> Result<(), SceneError> {
    if names.is_empty() {
        return Ok(());
    }
    let list: Vec<String> = path.shares().iter().map(|(name, _)| (*name).to_owned()).collect();
    let list: Vec<String> =
        list.into_iter().filter(|name| !name.is_empty()).map(|name| format!("`{name}`")).collect();
    let key = format!("{block}.leave_out");
    if list.is_empty() {
        let found = "features of a file that names none (`;TYPE:`, `; FEATURE:`)";
        return Err(source.error(&key, found, "nothing, or a file with such comments"));
    }
    let before = path.fed();
    for (index, name) in names.iter().enumerate() {
        match path.remove_feature(name) {
            None => {
                let allowed =
                    format!("what the file prints ({}), or one of {}", list.join(", "), FAMILIES.join(", "));
                return Err(source.error(&format!("{key}[{index}]"), format!("`{name}`"), allowed));
            }
            Some(0) => {
                notes.push(format!("nothing of `{name}` to leave out; the file prints {}", list.join(", ")))
            }
            Some(_) => {}
        }
    }
    let share = 100.0 * (1.0 - path.fed() / before);
    if !path.has_feed() {
        return Err(source.error(
            &key,
            "all that the file prints",
            format!("less than all of {}", list.join(", ")),
        ));
    }
    notes.push(format!("left out of the part: {share:.1} % of the filament ({})", names.join(", ")));
    Ok(())
}
