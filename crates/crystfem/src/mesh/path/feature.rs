//! Features of beads: names of slicers, unified.

use super::{Move, ToolPath};

/// Feature of moves before the first layer, in files with layer marks.
pub(super) const BEFORE_FIRST_LAYER: &str = "before the first layer";

/// Unified feature names, by which beads can be removed for any slicer.
pub const FAMILIES: [&str; 20] = [
    "skirt",
    "brim",
    "raft",
    "purge",
    "support",
    "support-interface",
    "wipe-tower",
    "outer-wall",
    "inner-wall",
    "overhang",
    "thin-wall",
    "gap-fill",
    "infill",
    "solid-infill",
    "top-surface",
    "bottom-surface",
    "bridge",
    "ironing",
    "shield",
    "mixed",
];

/// Converts a name to lower case with dashes: `Skirt/Brim` to `skirt-brim`.
pub(super) fn plain(name: &str) -> String {
    let lower = name.to_lowercase();
    let words = lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-")
}

/// Unified names of a plain name of PrusaSlicer, SuperSlicer, OrcaSlicer, Bambu Studio, Cura, Simplify3D or
/// ideaMaker.
fn families(plain: &str) -> &'static [&'static str] {
    match plain {
        "skirt" | "ooze-shield" | "draft-shield" => &["skirt", "shield"],
        "brim" => &["brim"],
        "skirt-brim" => &["skirt", "brim"],
        "raft" => &["raft"],
        "custom" | "before-the-first-layer" | "flush" | "purge" | "purge-line" | "prime-line" | "prime" => {
            &["purge"]
        }
        "support" | "support-material" | "dense-support" | "support-transition" => &["support"],
        "support-interface" | "support-material-interface" | "support-ironing" => {
            &["support", "support-interface"]
        }
        "wipe-tower" | "prime-tower" | "prime-pillar" => &["wipe-tower"],
        "external-perimeter" | "outer-wall" | "wall-outer" | "outer-perimeter" => &["outer-wall"],
        "perimeter" | "inner-wall" | "wall-inner" | "inner-perimeter" | "internal-perimeter" => {
            &["inner-wall"]
        }
        "overhang-perimeter" | "overhang-wall" => &["overhang"],
        "thin-wall" | "thin-walls" | "single-extrusion" => &["thin-wall"],
        "gap-fill" | "gap-infill" => &["gap-fill"],
        "internal-infill" | "sparse-infill" | "fill" | "infill" => &["infill"],
        "solid-infill" | "internal-solid-infill" | "skin" | "solid-layer" | "solid-fill" => &["solid-infill"],
        "top-solid-infill" | "top-surface" => &["solid-infill", "top-surface"],
        "bottom-surface" => &["solid-infill", "bottom-surface"],
        "bridge-infill" | "internal-bridge-infill" | "bridge" | "internal-bridge" => &["bridge"],
        "ironing" => &["ironing"],
        "mixed" | "multiple" => &["mixed"],
        _ => &[],
    }
}

/// Returns true if a feature of a file matches a name.
fn has_name(feature: &str, name: &str) -> bool {
    let (own, asked) = (plain(feature), plain(name));
    let asked = match asked.as_str() {
        "prime-tower" => "wipe-tower",
        "custom" | "prime" | "prime-line" | "purge-line" => "purge",
        "supports" => "support",
        other => other,
    };
    own == asked || families(&own).contains(&asked)
}

/// Returns true if a feature is not part of the body, but purged by the printer's own code.
pub(super) fn is_purge(feature: &str) -> bool {
    families(&plain(feature)).contains(&"purge")
}

impl ToolPath {
    /// Feature of a move, as named in the file; empty if unnamed.
    pub fn feature(&self, one: &Move) -> &str {
        self.features.get(usize::from(one.feature)).map_or("", String::as_str)
    }

    /// Printed features with their fractions of the filament fed, largest first; `""` for unnamed ones.
    pub fn shares(&self) -> Vec<(&str, f64)> {
        let mut fed = vec![0.0; self.features.len().max(1)];
        for one in self.printing_moves() {
            if let Some(sum) = fed.get_mut(usize::from(one.feature)) {
                *sum += one.fed;
            }
        }
        let whole: f64 = fed.iter().sum();
        let name = |k: usize| self.features.get(k).map_or("", String::as_str);
        let mut shares: Vec<(&str, f64)> =
            (0..fed.len()).filter(|&k| fed[k] > 0.0).map(|k| (name(k), fed[k] / whole)).collect();
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        shares
    }

    /// Turns beads of a feature (one of [`FAMILIES`], or a name of the file) into travel moves. Returns their
    /// number; `None` for an unknown name.
    pub fn remove_feature(&mut self, name: &str) -> Option<usize> {
        let hit: Vec<bool> = self.features.iter().map(|feature| has_name(feature, name)).collect();
        let known = hit.contains(&true) || FAMILIES.iter().any(|family| has_name(family, name));
        let mut count = 0;
        for one in self.moves.iter_mut().filter(|one| one.prints) {
            if hit.get(usize::from(one.feature)) == Some(&true) {
                one.prints = false;
                one.fed = 0.0;
                count += 1;
            }
        }
        known.then_some(count)
    }
}
