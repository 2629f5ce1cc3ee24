//! Keys of scenes in place of keywords without effect on the mesh.

/// Advice and the keywords that it is about.
const ADVICE: [(&str, &[&str]); 15] = [
    ("the deck has no units; give `density` of [materials.NAME]", &["DENSITY"]),
    ("the deck has no units; give `conductivity` of [materials.NAME]", &["CONDUCTIVITY"]),
    ("the deck has no units; give `specific_heat` of [materials.NAME]", &["SPECIFIC HEAT"]),
    ("the deck has no units; give `latent_heat` of [materials.NAME]", &["LATENT HEAT"]),
    ("the deck has no units; give [materials.NAME]", &["MATERIAL", "USER MATERIAL", "DEPVAR"]),
    ("the deck has no units; give [[region]] with `elements`", &["SOLID SECTION"]),
    ("the deck has no units; give `temperature` of [[region]]", &["INITIAL CONDITIONS"]),
    (
        "the deck has no units; give `temperature` of [[boundary]], whose `surface` may be a node set",
        &["BOUNDARY", "TEMPERATURE"],
    ),
    ("the deck has no units; give `film` and `ambient` of [[boundary]]", &["FILM", "SFILM", "FILM PROPERTY"]),
    ("the deck has no units; give `emissivity` and `ambient` of [[boundary]]", &["RADIATE", "SRADIATE"]),
    (
        "the deck has no units; give `flux` of [[boundary]], or `power` of [[source]]",
        &["DFLUX", "DSFLUX", "CFLUX"],
    ),
    ("the deck has no units; give values over time, `{ time = […], value = […] }`", &["AMPLITUDE"]),
    (
        "the deck has no units; give [time]",
        &["HEAT TRANSFER", "COUPLED TEMPERATURE-DISPLACEMENT", "UNCOUPLED TEMPERATURE-DISPLACEMENT"],
    ),
    ("the deck has no units; give [mechanics]", &["ELASTIC", "EXPANSION", "PLASTIC", "VISCOELASTIC"]),
    (
        "heat passes only between elements that share nodes: merge the nodes of the parts",
        &["TIE", "CONTACT PAIR", "CONTACT", "EQUATION", "MPC", "GAP CONDUCTANCE", "EMBEDDED ELEMENT"],
    ),
];

/// Names the scene key that replaces a keyword.
pub fn advice(keyword: &str) -> Option<&'static str> {
    ADVICE.iter().find(|(_, all)| all.contains(&keyword)).map(|(advice, _)| *advice)
}
