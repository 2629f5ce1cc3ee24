//! Keywords of a deck: lines, options and data, and what each does to the law of its material.

/// DeckKeyword with its data lines.
#[derive(Debug)]
pub(super) struct DeckKeyword<'a> {
    pub line: usize,
    /// Text of its line.
    pub written: &'a str,
    /// Name in capitals, with its `*`.
    pub name: String,
    /// Options in capitals: `OGDEN`, `N=2`.
    pub options: Vec<String>,
    /// Data lines with their numbers.
    data: Vec<(usize, &'a str)>,
}

impl DeckKeyword<'_> {
    /// Value of an option.
    pub fn value(&self, key: &str) -> Option<String> {
        self.options.iter().find_map(|option| {
            let (found, value) = option.split_once('=')?;
            (found.trim() == key).then(|| value.trim().to_owned())
        })
    }

    /// Numbers of each data line; a blank is 0, that after a comma at the end is none.
    ///
    /// # Errors
    /// The line of a cell that is no finite number.
    pub fn rows(&self) -> Result<Vec<Vec<f64>>, String> {
        let row = |&(line, row): &(usize, &str)| {
            let row = row.strip_suffix(',').unwrap_or(row);
            let number = |cell: &str| {
                let cell = cell.trim();
                let number = if cell.is_empty() { Ok(0.0) } else { cell.parse::<f64>() };
                let finite = number.ok().filter(|number| number.is_finite());
                finite.ok_or_else(|| format!("line {line}: found `{cell}`; allowed: a finite number"))
            };
            row.split(',').map(number).collect()
        };
        self.data.iter().map(row).collect()
    }

    /// Numbers of all data lines.
    ///
    /// # Errors
    /// As [`Self::rows`].
    pub fn numbers(&self) -> Result<Vec<f64>, String> {
        Ok(self.rows()?.concat())
    }
}

/// Splits a deck into its keywords; a keyword whose line ends in a comma continues on the next one.
pub(super) fn keywords(text: &str) -> Vec<DeckKeyword<'_>> {
    let mut all: Vec<DeckKeyword> = Vec::new();
    let mut continues = false;
    for (line, written) in (1..).zip(text.lines().map(str::trim)) {
        if written.is_empty() || written.starts_with("**") {
            continue;
        }
        let parts = || {
            let words = |part: &str| part.split_whitespace().collect::<Vec<_>>().join(" ").to_uppercase();
            written.split(',').map(words).filter(|part| !part.is_empty())
        };
        if written.starts_with('*') {
            let mut parts = parts();
            let name = parts.next().unwrap_or_default();
            all.push(DeckKeyword { line, written, name, options: parts.collect(), data: Vec::new() });
            continues = written.ends_with(',');
        } else if let Some(last) = all.last_mut() {
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

/// Effect of a keyword with its `*`, in capitals; `None` if it belongs to no material.
pub(super) fn class(name: &str) -> Option<KeywordClass> {
    let lists: [(&[&str], KeywordClass); 6] = [
        (&["*MATERIAL"], KeywordClass::Material),
        (&LAWS, KeywordClass::Law),
        (&RATES, KeywordClass::Rate),
        (&BEYOND, KeywordClass::Beyond),
        (&APART, KeywordClass::Apart),
        (&OTHERS, KeywordClass::Other),
    ];
    lists.into_iter().find(|(names, _)| names.contains(&name)).map(|(_, class)| class)
}
