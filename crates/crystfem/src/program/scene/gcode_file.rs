//! G-code files in a scene: filament, times, and moves that are left out of the part.

use super::locate_error::located_in;
use crate::mesh::path::{FAMILIES, FILAMENT, ToolPath};
use harness::scene::{SceneError, Source};
use polycore::units::{Acceleration, Length, Speed};

/// Parameters and their keys in the block.
const KEYS: [(&str, &str); 2] = [("acceleration", "acceleration"), ("jerk", "jerk")];
/// Diameters closer than this (relative) count as equal.
const DIAMETER_TOLERANCE: f64 = 1e-3;
/// Largest fraction of the filament in moves outside the part.
const MOST_LOOSE: f64 = 0.1;

/// Returns the diameter of the filament, m: from the scene, from the file, or the usual one.
pub(super) fn filament(
    source: &Source,
    block: &str,
    path: &ToolPath,
    given: Option<Length>,
) -> Result<f64, SceneError> {
    let given = given.map(|x| x.si());
    if let (Some(own), Some(stated), true) = (given, path.filament, path.volumetric)
        && (own / stated - 1.0).abs() > DIAMETER_TOLERANCE
    {
        let allowed = format!(
            "{} mm, or no `filament`: E in the file is a volume (M200) of this diameter",
            1e3 * stated
        );
        return Err(source.error(&format!("{block}.filament"), format!("{} mm", 1e3 * own), allowed));
    }
    Ok(given.or(path.filament).unwrap_or(FILAMENT))
}

/// Returns the path timed by the limits of the scene or of the file, or at F; notes how its duration compares
/// with the slicer's estimate.
pub(super) fn with_times(
    source: &Source,
    block: &str,
    path: ToolPath,
    acceleration: Option<Acceleration>,
    jerk: Option<Speed>,
    notes: &mut Vec<String>,
) -> Result<ToolPath, SceneError> {
    let (path, with) = match (acceleration, jerk) {
        (None, None) => match path.describe_limits() {
            Some(limits) => {
                notes.push(format!(
                    "path times follow the limits in the file: {limits}; waits for temperatures are ignored"
                ));
                (path.with_stated_limits(), "with the limits in the file")
            }
            None => {
                notes.push(
                    "path times follow F: the file has no acceleration limits; waits for temperatures are \
                     ignored"
                        .into(),
                );
                (path, "at F")
            }
        },
        (Some(acceleration), Some(jerk)) => {
            let path = path.with_acceleration(acceleration.si(), jerk.si());
            (path.map_err(|error| located_in(source, block, &KEYS, &error))?, "with the limits of the scene")
        }
        (given, _) => {
            let missing = if given.is_some() { "jerk" } else { "acceleration" };
            return Err(source.missing(
                &format!("{block}.{missing}"),
                "`acceleration` and `jerk` need each other; write both or neither",
            ));
        }
    };
    notes.extend(path.compare_estimate(with));
    Ok(path)
}

/// Removes beads without support, such as purge lines at z = 0.
pub(super) fn without_loose_beads(
    source: &Source,
    key: &str,
    mut path: ToolPath,
    notes: &mut Vec<String>,
) -> Result<ToolPath, SceneError> {
    if let Some((count, line, share)) = path.remove_loose() {
        let text = format!(
            "{count} printing moves lie at or below the bed (z ≤ 0) or have no support, the first in line \
             {line}: {:.2} % of the filament",
            100.0 * share
        );
        if share > MOST_LOOSE {
            return Err(source.error(key, text, "beads above the bed (z = 0)"));
        }
        notes.push(format!("{text}, left out"));
    }
    Ok(path)
}

/// Removes features of the slicer from the part.
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
        let why = "the file names no features (`;TYPE:`, `; FEATURE:`); remove the key";
        return Err(source.unexpected(&key, why));
    }
    let before = path.fed();
    for (index, name) in names.iter().enumerate() {
        match path.remove_feature(name) {
            None => {
                let allowed =
                    format!("a feature of the file ({}), or one of {}", list.join(", "), FAMILIES.join(", "));
                return Err(source.error(&format!("{key}[{index}]"), format!("`{name}`"), allowed));
            }
            Some(0) => {
                notes.push(format!("found no `{name}` to leave out; the file prints {}", list.join(", ")))
            }
            Some(_) => {}
        }
    }
    let share = 100.0 * (1.0 - path.fed() / before);
    if !path.has_feed() {
        return Err(source.error(
            &key,
            "all features of the file",
            format!("some of {}, not all", list.join(", ")),
        ));
    }
    notes.push(format!("left out of the part: {share:.1} % of the filament ({})", names.join(", ")));
    Ok(())
}
