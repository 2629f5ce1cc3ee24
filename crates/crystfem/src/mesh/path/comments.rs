//! Comments of slicers: features, heights, layers, estimates, settings.

use super::feature::BEFORE_FIRST_LAYER;
use super::limits::Limits;

/// Feature before any is named.
const NONE: &str = "";
/// Placeholder of Cura's command line for a missing estimate, s.
const PLACEHOLDER: f64 = 6666.0;

/// State read from comments.
#[derive(Debug)]
pub(super) struct Comments {
    /// Names of features.
    pub features: Vec<String>,
    /// Current feature.
    pub feature: u16,
    /// Bead height, m; 0 if not stated.
    height: f64,
    /// Number of layer marks.
    pub layers: usize,
    /// Print time estimated by the slicer, s, with rank 0 from the first layer on.
    pub estimate: Option<(u8, f64)>,
    /// Duration of a filament change, s.
    pub change: f64,
    /// True if E is a volume throughout.
    pub volumetric: bool,
    /// Diameters of filaments, m, by tool.
    pub filaments: Vec<f64>,
    /// True for a Bambu printer, whose part fan is P1.
    pub bambu: bool,
    /// True for RepRapFirmware, with velocities per minute.
    pub per_minute: bool,
    /// True if the slicer ignored the machine's limits.
    pub limits_ignored: bool,
}

impl Comments {
    /// Returns the initial state; `marked` if the file marks its layers.
    pub fn new(marked: bool) -> Self {
        let mut new = Self {
            features: vec![NONE.to_owned()],
            feature: 0,
            height: 0.0,
            layers: 0,
            estimate: None,
            change: 0.0,
            volumetric: false,
            filaments: Vec::new(),
            bambu: false,
            per_minute: false,
            limits_ignored: false,
        };
        if marked {
            new.name(BEFORE_FIRST_LAYER);
        }
        new
    }

    /// Height of the beads that follow, m; 0 if no comment states it, as in a printer's own code.
    pub fn height(&self) -> f64 {
        let own =
            self.features.get(usize::from(self.feature)).is_some_and(|name| super::feature::is_purge(name));
        if own { 0.0 } else { self.height }
    }

    fn name(&mut self, name: &str) {
        let known = self.features.iter().position(|other| other.eq_ignore_ascii_case(name));
        let at = known.unwrap_or_else(|| {
            // no slicer writes more names than this
            if self.features.len() < 1000 {
                self.features.push(name.to_owned());
            }
            self.features.len() - 1
        });
        self.feature = at as u16;
    }

    fn layer(&mut self) {
        self.layers += 1;
        // the printer's own code ends here; the slicer names the following features
        let own =
            self.features.get(usize::from(self.feature)).is_some_and(|name| super::feature::is_purge(name));
        if own {
            self.feature = 0;
        }
    }

    /// Reads a comment, without its `;`.
    pub fn read(&mut self, comment: &str, limits: &mut Limits) {
        let text = comment.trim();
        let after = |names: &[&str]| {
            let begins =
                |name: &&&str| text.get(..name.len()).is_some_and(|own| own.eq_ignore_ascii_case(name));
            names.iter().find(begins).map(|name| text[name.len()..].trim())
        };
        if let Some(name) = after(&["TYPE:", "FEATURE:", "feature "]) {
            self.name(name);
        } else if is_layer(text) {
            self.layer();
        } else if let Some(height) = after(&["HEIGHT:", "LAYER_HEIGHT:"]) {
            let height = height.parse().unwrap_or(0.0);
            self.height = if height > 0.0 && height < 1e3 { 1e-3 * height } else { 0.0 };
        } else if let Some(rest) = after(&["tool H"]) {
            // Simplify3D: `tool H0.200 W0.400`
            let height = rest.split_whitespace().next().and_then(|word| word.parse().ok()).unwrap_or(0.0);
            self.height = if height > 0.0 && height < 1e3 { 1e-3 * height } else { 0.0 };
        } else if let Some(seconds) = estimate(text) {
            if self.estimate.is_none_or(|known| known.0 > seconds.0) {
                self.estimate = Some(seconds);
            }
        } else if let Some((key, value)) = text.split_once(['=', ':']) {
            self.setting(key.trim(), value.trim(), limits);
        }
        self.bambu |= text.starts_with("BambuStudio");
    }

    fn setting(&mut self, key: &str, value: &str, limits: &mut Limits) {
        let first = || value.split(',').next().and_then(|word| word.trim().parse::<f64>().ok());
        match key {
            "filament_diameter" | "filamentDiameters" if self.filaments.is_empty() => {
                let all = value.split([',', '|']).map_while(|word| word.trim().parse::<f64>().ok());
                self.filaments =
                    all.filter(|found| *found > 0.1 && *found < 20.0).map(|d| 1e-3 * d).collect();
            }
            "machine_load_filament_time"
            | "machine_unload_filament_time"
            | "filament_load_time"
            | "filament_unload_time" => {
                self.change += first().filter(|s| *s > 0.0 && *s < 1e4).unwrap_or(0.0);
            }
            "FLAVOR" => self.volumetric = value.contains("Volumetric") || value == "UltiGCode",
            "gcode_flavor" => self.per_minute |= value.eq_ignore_ascii_case("reprapfirmware"),
            "machine_limits_usage" => self.limits_ignored = value == "ignore",
            "printer_model" => self.bambu |= value.starts_with("Bambu Lab"),
            _ if key.starts_with("machine_max_") => {
                if let Some(found) = first() {
                    limits.setting(key, found);
                }
            }
            _ => {}
        }
    }
}

/// Returns true if a comment begins a layer: PrusaSlicer, SuperSlicer, OrcaSlicer; Bambu Studio; Cura,
/// ideaMaker; Simplify3D.
pub(super) fn is_layer(text: &str) -> bool {
    let numbered = |prefix: &str| {
        let rest = text.strip_prefix(prefix).map(str::trim_start);
        rest.is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit() || c == '-'))
    };
    text == "LAYER_CHANGE"
        || text == "CHANGE_LAYER"
        || numbered("LAYER:")
        || (numbered("layer ") && text.contains("Z ="))
}

/// Parses an estimate, s, and its rank: 0 from the first layer on, 1 for the whole print.
fn estimate(text: &str) -> Option<(u8, f64)> {
    if let Some(rest) = text.strip_prefix("TIME:").or_else(|| text.strip_prefix("Print Time:")) {
        return rest.trim().parse().ok().filter(|s: &f64| *s > 0.0 && *s != PLACEHOLDER).map(|s| (1, s));
    }
    if let Some(rest) = text.strip_prefix("model printing time:") {
        let own = rest.split(';').next()?;
        return duration(own).map(|seconds| (0, seconds));
    }
    let rest = text.strip_prefix("estimated printing time").or_else(|| text.strip_prefix("Build time"))?;
    if rest.contains("silent") || rest.contains("first layer") {
        return None;
    }
    let (_, value) = rest.split_once(['=', ':'])?;
    duration(value).map(|seconds| (1, seconds))
}

/// Parses `1d 2h 3m 4s`, or the same with words (`2 hours 3 minutes`).
fn duration(text: &str) -> Option<f64> {
    let mut seconds = 0.0;
    let mut rest = text.trim();
    let mut found = false;
    while let Some(end) = rest.find(|c: char| !(c.is_ascii_digit() || c == '.')) {
        let number: f64 = rest[..end].parse().ok()?;
        rest = rest[end..].trim_start();
        let unit = rest.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(rest.len());
        seconds += number
            * match rest[..unit].chars().next()? {
                'd' => 86400.0,
                'h' => 3600.0,
                'm' => 60.0,
                's' => 1.0,
                _ => return None,
            };
        found = true;
        rest = rest[unit..].trim_start();
    }
    (found && seconds > 0.0).then_some(seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_slicers() {
        for (text, found) in [
            ("estimated printing time (normal mode) = 1d 2h 3m 4s", Some((1, 93784.0))),
            ("estimated printing time (silent mode) = 1h 0m 0s", None),
            ("estimated first layer printing time (normal mode) = 1m", None),
            ("model printing time: 8m 57s; total estimated time: 15m 42s", Some((0, 537.0))),
            ("TIME:1012", Some((1, 1012.0))),
            ("TIME:6666", None),
            ("TIME_ELAPSED:5.3", None),
            ("Build time: 1 hours 24 minutes", Some((1, 5040.0))),
        ] {
            assert_eq!(estimate(text), found, "{text}");
        }
    }

    #[test]
    fn layers_of_slicers() {
        for text in ["LAYER_CHANGE", "CHANGE_LAYER", "LAYER:0", "LAYER:-2", "layer 1, Z = 0.200"] {
            assert!(is_layer(text), "{text}");
        }
        for text in ["LAYER_COUNT:5", "Layer height: 0.2", "BEFORE_LAYER_CHANGE", "layer 1 of 5"] {
            assert!(!is_layer(text), "{text}");
        }
    }
}
