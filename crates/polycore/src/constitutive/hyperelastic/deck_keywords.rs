//! Keywords of a deck: lines, options and data, and what each does to the law of its material.

/// Keyword of a deck with its data lines.
#[derive(Debug)]
pub(super) struct DeckKeyword<'a> {
    pub line: usize,
    /// Text of its line.
    pub written: &'a str,
    /// Name in capitals, with its `*`.
    pub name: String,
    /// Options in capitals: `OGDEN`, `N=2`.
    pub options: Vec<String>,
    /// Comments since the line before.
    pub comments: Vec<&'a str>,
    /// Data lines with their numbers.
    data: Vec<(usize, &'a str)>,
}

/// Cells of a data line.
const CELLS: usize = 8;

/// Reads the number of a cell, of which the exponent may be a `D` as in Fortran; a blank is 0.
pub(super) fn cell_number(cell: &str) -> Option<f64> {
    let cell = cell.trim();
    let number = if cell.is_empty() { Ok(0.0) } else { cell.replace(['d', 'D'], "E").parse::<f64>() };
    number.ok().filter(|number| number.is_finite())
}

/// Decodes the bytes of a deck: UTF-8 with or without a byte-order mark, else Latin-1.
pub(super) fn decoded(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.trim_start_matches('\u{feff}').to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}

/// Notes on a card of a run from the comments above its material: the warnings, and the law that it was
/// written for if the card is read as another one.
pub(super) fn card_notes(comments: &[&str], key: &str) -> Vec<String> {
    let title = comments.iter().rposition(|comment| comment.contains(" fitted to "));
    let own = &comments[title.unwrap_or(0)..];
    let fitted = title.and_then(|title| comments[title].split(' ').next()).filter(|fitted| *fitted != key);
    let other = fitted.map(|fitted| format!("written for `{fitted}`, read as `{key}`"));
    let warnings = own.iter().filter(|comment| comment.starts_with("warning: "));
    warnings.map(|warning| (*warning).to_owned()).chain(other).collect()
}

impl DeckKeyword<'_> {
    /// Value of an option.
    pub fn value(&self, key: &str) -> Option<String> {
        self.options.iter().find_map(|option| {
            let (found, value) = option.split_once('=')?;
            (found.trim() == key).then(|| value.trim().to_owned())
        })
    }

    /// Numbers of each data line; a blank is 0, those after commas at the end are none.
    ///
    /// # Errors
    /// The line of a cell that is no finite number.
    pub fn rows(&self) -> Result<Vec<Vec<f64>>, String> {
        let row = |&(line, row): &(usize, &str)| {
            let row = row.trim_end_matches(|c: char| c == ',' || c.is_whitespace());
            let number = |cell: &str| {
                let finite = cell_number(cell);
                finite
                    .ok_or_else(|| format!("line {line}: found `{}`; allowed: a finite number", cell.trim()))
            };
            row.split(',').map(number).collect()
        };
        self.data.iter().map(row).collect()
    }

    /// Numbers of all data lines of eight cells; those left out at the end of a line are 0, those of the last
    /// line missing.
    ///
    /// # Errors
    /// As [`Self::rows`]; a line of more cells.
    pub fn numbers(&self) -> Result<Vec<f64>, String> {
        let mut rows = self.rows()?;
        if let Some(at) = rows.iter().position(|row| row.len() > CELLS) {
            let (line, row) = self.data[at];
            return Err(format!("line {line}: found `{row}`; allowed: {CELLS} numbers a line"));
        }
        if let Some((_, all)) = rows.split_last_mut() {
            all.iter_mut().for_each(|row| row.resize(CELLS, 0.0));
        }
        Ok(rows.concat())
    }

    /// Returns true for test data in place of parameters, in the keywords that follow.
    pub fn has_test_data(&self) -> bool {
        let is_option = self.options.iter().any(|option| option == "TEST DATA INPUT");
        is_option || self.value("TIME").is_some_and(|source| source.ends_with("TEST DATA"))
    }
}

/// Splits a deck into its keywords; a keyword whose line ends in a comma continues on the next one.
pub(super) fn keywords(text: &str) -> Vec<DeckKeyword<'_>> {
    let mut all: Vec<DeckKeyword> = Vec::new();
    let mut continues = false;
    let mut comments = Vec::new();
    for (line, written) in (1..).zip(text.lines().map(str::trim)) {
        if let Some(comment) = written.strip_prefix("**") {
            comments.push(comment.trim());
            continue;
        }
        if written.is_empty() {
            continue;
        }
        let parts = || {
            let words = |part: &str| part.split_whitespace().collect::<Vec<_>>().join(" ").to_uppercase();
            written.split(',').map(words).filter(|part| !part.is_empty())
        };
        if written.starts_with('*') {
            let mut parts = parts();
            let name = parts.next().unwrap_or_default();
            let (comments, options) = (std::mem::take(&mut comments), parts.collect());
            all.push(DeckKeyword { line, written, name, options, comments, data: Vec::new() });
            continues = written.ends_with(',');
        } else if let Some(last) = all.last_mut() {
            comments.clear();
            match continues {
                true => last.options.extend(parts()),
                false => last.data.push((line, written)),
            }
            continues = continues && written.ends_with(',');
        }
    }
    all
}

/// Effect of a material's keyword on its law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum KeywordClass {
    /// Begins a material.
    Material,
    /// States a law that this crate may have.
    Law,
    /// Makes it depend on the rate.
    Rate,
    /// Softens or damages it after the first loading.
    Beyond,
    /// Has nothing to do with elasticity.
    Apart,
    /// Is, or changes to, another law.
    Other,
    /// Stands outside of materials.
    Outside,
}

const LAWS: [&str; 3] = ["*HYPERELASTIC", "*HYPERFOAM", "*USER MATERIAL"];
const RATES: [&str; 4] = ["*VISCOELASTIC", "*HYSTERESIS", "*SHEAR TEST DATA", "*COMBINED TEST DATA"];
const BEYOND: [&str; 4] =
    ["*MULLINS EFFECT", "*DAMAGE INITIATION", "*DAMAGE EVOLUTION", "*DAMAGE STABILIZATION"];
const APART: [&str; 27] = [
    "*ACOUSTIC MEDIUM",
    "*CONDUCTIVITY",
    "*DAMPING",
    "*DENSITY",
    "*DEPVAR",
    "*DIELECTRIC",
    "*DIFFUSIVITY",
    "*ELECTRICAL CONDUCTIVITY",
    "*EXPANSION",
    "*FLUID BULK MODULUS",
    "*GEL",
    "*HEAT GENERATION",
    "*INELASTIC HEAT FRACTION",
    "*JOULE HEAT FRACTION",
    "*LATENT HEAT",
    "*MAGNETIC PERMEABILITY",
    "*MOISTURE SWELLING",
    "*PERMEABILITY",
    "*POROUS BULK MODULI",
    "*SOLUBILITY",
    "*SORPTION",
    "*SPECIFIC HEAT",
    "*SPECIFIC GAS CONSTANT",
    "*SWELLING",
    "*TRS",
    "*USER OUTPUT VARIABLES",
    "*VISCOSITY",
];
const OTHERS: [&str; 43] = [
    "*ANISOTROPIC HYPERELASTIC",
    "*BIAXIAL TEST DATA",
    "*BRITTLE CRACKING",
    "*CAP PLASTICITY",
    "*CAST IRON PLASTICITY",
    "*CLAY PLASTICITY",
    "*CONCRETE",
    "*CONCRETE DAMAGED PLASTICITY",
    "*CREEP",
    "*CRUSHABLE FOAM",
    "*CYCLIC HARDENING",
    "*DEFORMATION PLASTICITY",
    "*DRUCKER PRAGER",
    "*ELASTIC",
    "*EOS",
    "*FABRIC",
    "*FAIL STRAIN",
    "*FAIL STRESS",
    "*HYPOELASTIC",
    "*JOINTED MATERIAL",
    "*LOW DENSITY FOAM",
    "*MOHR COULOMB",
    "*NO COMPRESSION",
    "*NO TENSION",
    "*ORNL",
    "*PIEZOELECTRIC",
    "*PLANAR TEST DATA",
    "*PLASTIC",
    "*POROUS ELASTIC",
    "*POROUS METAL PLASTICITY",
    "*POTENTIAL",
    "*RATE DEPENDENT",
    "*SHEAR FAILURE",
    "*SIMPLE SHEAR TEST DATA",
    "*SUPERELASTIC",
    "*TENSILE FAILURE",
    "*TRIAXIAL TEST DATA",
    "*UNIAXIAL",
    "*UNIAXIAL TEST DATA",
    "*USER DEFINED FIELD",
    "*VISCOUS",
    "*VOID NUCLEATION",
    "*VOLUMETRIC TEST DATA",
];

const OUTSIDE: [&str; 46] = [
    "*AMPLITUDE",
    "*ASSEMBLY",
    "*BOUNDARY",
    "*BUCKLE",
    "*CHANGE FRICTION",
    "*CLEARANCE",
    "*CLOAD",
    "*CONTROLS",
    "*COUPLED TEMPERATURE-DISPLACEMENT",
    "*COUPLING",
    "*DISTRIBUTION",
    "*DISTRIBUTION TABLE",
    "*DLOAD",
    "*DSLOAD",
    "*DYNAMIC",
    "*ELSET",
    "*EQUATION",
    "*FASTENER",
    "*FREQUENCY",
    "*FRICTION",
    "*HEADING",
    "*HEAT TRANSFER",
    "*IMPORT",
    "*INITIAL CONDITIONS",
    "*INSTANCE",
    "*KINEMATIC COUPLING",
    "*MONITOR",
    "*MPC",
    "*NGEN",
    "*NSET",
    "*ORIENTATION",
    "*OUTPUT",
    "*PART",
    "*PHYSICAL CONSTANTS",
    "*PREPRINT",
    "*RESTART",
    "*RIGID BODY",
    "*SECTION CONTROLS",
    "*SPRING",
    "*STATIC",
    "*STEP",
    "*TEMPERATURE",
    "*TIE",
    "*TIME POINTS",
    "*TRANSFORM",
    "*VISCO",
];
/// Beginnings of keywords outside of materials.
const OUTSIDE_BEGINS: [&str; 6] = ["*CONTACT", "*ELEMENT", "*EL ", "*END ", "*NODE", "*SURFACE"];

/// Effect of a keyword with its `*`, in capitals; `None` if it is not known.
pub(super) fn class(name: &str) -> Option<KeywordClass> {
    let lists: [(&[&str], KeywordClass); 6] = [
        (&["*MATERIAL"], KeywordClass::Material),
        (&LAWS, KeywordClass::Law),
        (&RATES, KeywordClass::Rate),
        (&BEYOND, KeywordClass::Beyond),
        (&APART, KeywordClass::Apart),
        (&OTHERS, KeywordClass::Other),
    ];
    let known = lists.into_iter().find(|(names, _)| names.contains(&name)).map(|(_, class)| class);
    let outside = || {
        let begins = || OUTSIDE_BEGINS.iter().any(|start| name.starts_with(start));
        OUTSIDE.contains(&name) || name.ends_with(" SECTION") || begins()
    };
    known.or_else(|| outside().then_some(KeywordClass::Outside))
}
