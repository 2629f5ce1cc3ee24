//! Predictions for a table of compositions, and their deviations from measured moduli.
//!
//! The model answers where the conversion is known: given, or from a measured sol fraction. It refuses what
//! a row leaves open, with the reason. No number is fitted to a measured modulus.

use super::table::{Composition, CompositionTable};
use super::{EndLinked, Error, KnownPolymer, LOOP_FACTOR, LinkerMix, Melt, PolymerNetwork, PrimaryChains};
use super::{KNOWN_POLYMERS, Reacted, Vulcanized, known_polymer};

/// Entanglement modulus of the bead model of the simulated PDMS networks, Pa (94.79 mol/m³ RT,
/// doi:10.1021/acspolymersau.5c00036).
pub const SIMULATED_ENTANGLEMENT_MODULUS: f64 = 0.235e6;

/// Functionality beyond which a cross-linker without a molar mass is refused.
const LARGEST_POINT: f64 = 100.0;

/// Columns that predictions add to those of the compositions.
const ADDED: [&str; 14] = [
    "predicted_G_MPa",
    "predicted_phantom_MPa",
    "predicted_entangled_MPa",
    "stiffening",
    "predicted_sol",
    "kuhn_segments",
    "locking_stretch",
    "fracture_energy_low_J_m2",
    "fracture_energy_high_J_m2",
    "conversion",
    "least_conversion",
    "conversion_from",
    "deviation",
    "reason",
];

/// Which of a given conversion and a measured sol fraction counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ConversionSource {
    /// The conversion of a simulated network, and one of 1; otherwise the sol fraction, and a given
    /// conversion below 1 only without it: what tables give beside a measured sol is derived from it.
    #[default]
    Best,
    /// The conversion, and the sol fraction only without it.
    Given,
    /// The sol fraction, and the conversion only without it.
    Sol,
}

/// Settings of predictions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictionSettings {
    /// Polymer of rows that name none.
    pub polymer: &'static KnownPolymer,
    /// Density, kg/m³; that of the polymer if `None`.
    pub density: Option<f64>,
    /// Temperature, K.
    pub temperature: f64,
    /// Entanglement modulus of all rows, Pa; if `None` that of the polymer and, of simulated PDMS, of its
    /// bead model.
    pub entanglement_modulus: Option<f64>,
    /// Choice between conversion and sol fraction.
    pub conversion: ConversionSource,
    /// Factor of loops in conversions from sol fractions; 0 for the tree theory.
    pub loop_factor: f64,
}

impl Default for PredictionSettings {
    fn default() -> Self {
        Self {
            polymer: &KNOWN_POLYMERS[0],
            density: None,
            temperature: 298.15,
            entanglement_modulus: None,
            conversion: ConversionSource::Best,
            loop_factor: LOOP_FACTOR,
        }
    }
}

impl PredictionSettings {
    /// Sets the polymer by its name.
    ///
    /// # Errors
    /// An unknown polymer.
    pub fn polymer(self, name: &str) -> Result<Self, Error> {
        Ok(Self { polymer: known_polymer(name)?, ..self })
    }

    fn melt(&self, row: &Composition) -> Result<Melt, Error> {
        let polymer = row.polymer.unwrap_or(self.polymer);
        let missing = |property| Error::Missing { polymer: polymer.name, property };
        let of_beads = row.is_simulated && polymer.name == "PDMS";
        let known =
            if of_beads { Some(SIMULATED_ENTANGLEMENT_MODULUS) } else { polymer.entanglement_modulus };
        Ok(Melt {
            density: self.density.or(polymer.density).ok_or_else(|| missing("density"))?,
            temperature: self.temperature,
            entanglement_modulus: self
                .entanglement_modulus
                .or(known)
                .ok_or_else(|| missing("entanglement modulus"))?,
            chain: Some(polymer.chain),
            extracted: row.extracted,
        })
    }

    /// Predicts the network of a row; the error is the reason why the model does not apply.
    ///
    /// # Errors
    /// Missing values of the row; as [`EndLinked::network`].
    pub fn predict(&self, row: &Composition) -> Result<NetworkPrediction, String> {
        if let Some(chains) = row.primary_chains {
            return self.at_random(row, chains);
        }
        if let Some(units) = row.units {
            return Err(format!("`x` = {units} without `chains`: the distribution of the chains decides"));
        }
        let given = |name: &str, value: Option<f64>| value.ok_or_else(|| format!("`{name}` is not given"));
        let functionality = given("f", row.functionality)?;
        let ratio = given("r", row.ratio)?;
        let strand_mass = given("M_strand_kg_mol", row.strand_mass)?;
        if functionality > LARGEST_POINT && row.linker_mass.is_none() {
            return Err(format!(
                "`f` = {functionality} without `M_linker_kg_mol`: such a cross-linker is a chain itself, \
                 whose mass and strands count"
            ));
        }
        let ends = match (row.ends_mass, row.ends_share) {
            (Some(mass), None) if mass > 0.0 => {
                return Err(format!(
                    "`M_mono_kg_mol` = {mass}: the share of chains with one group is unknown; add a column \
                     `b1`"
                ));
            }
            (mass, share) => (share.unwrap_or(0.0), mass.unwrap_or(0.0)),
        };
        let (reacted, origin) = self.reacted(row, ratio)?;
        let recipe = EndLinked::new(1, strand_mass, reacted)
            .linkers(LinkerMix::mean(functionality).map_err(|error| error.to_string())?)
            .ratio(ratio)
            .linker_mass(row.linker_mass.unwrap_or(0.0))
            .ends(ends.0, ends.1)
            .loop_factor(self.loop_factor);
        let network = self.melt(row).and_then(|melt| recipe.network(&melt));
        Ok(NetworkPrediction { network: network.map_err(|error| with_column(&error, row))?, origin })
    }

    /// Predicts long chains that are cross-linked at random: a measured sol fraction counts before `x`,
    /// unless the given value is asked for.
    fn at_random(&self, row: &Composition, chains: PrimaryChains) -> Result<NetworkPrediction, String> {
        for (name, value) in
            [("f", row.functionality), ("r", row.ratio), ("p", row.conversion), ("b1", row.ends_share)]
        {
            if let Some(value) = value {
                return Err(format!("`{name}` = {value} beside `chains`: of end-linked networks only"));
            }
        }
        let mass = row.strand_mass.ok_or("`M_strand_kg_mol` is not given")?;
        let sol = row.sol.filter(|_| row.units.is_none() || self.conversion != ConversionSource::Given);
        let (recipe, origin) = match (row.units, sol) {
            (_, Some(sol)) => (
                Vulcanized::with_sol(chains, mass, sol).map_err(|error| with_column(&error, row))?,
                "x from w_sol, without loops: a lower bound",
            ),
            (Some(units), None) => (Vulcanized::new(chains, mass, units), "x"),
            (None, None) => return Err("neither `x` nor `w_sol` is given".to_owned()),
        };
        let network = self.melt(row).and_then(|melt| recipe.network(&melt));
        Ok(NetworkPrediction { network: network.map_err(|error| with_column(&error, row))?, origin })
    }

    /// Returns what is known about the reaction, and in words from where.
    fn reacted(&self, row: &Composition, ratio: f64) -> Result<(Reacted, &'static str), String> {
        let of_sol = |sol| {
            let origin = match self.loop_factor > 0.0 {
                true => "w_sol, loops allowed for; least_conversion without loops",
                false => "w_sol, without loops: a lower bound",
            };
            Ok((Reacted::SolFraction(sol), origin))
        };
        let complete = row.conversion == Some(1.0);
        let prefers_sol = match self.conversion {
            ConversionSource::Best => !(row.is_simulated || complete),
            ConversionSource::Given => false,
            ConversionSource::Sol => true,
        };
        match (row.conversion, row.sol) {
            (Some(_), Some(sol)) if prefers_sol => of_sol(sol),
            (Some(_), _) if complete && ratio > 1.0 => {
                Ok((Reacted::Complete, "p = 1, of the groups in deficit: p_A = 1/r, nominal"))
            }
            (Some(_), _) if complete && !row.is_simulated => Ok((Reacted::Complete, "p = 1, nominal")),
            (Some(conversion), _) => Ok((Reacted::Conversion(conversion), "p")),
            (None, Some(sol)) => of_sol(sol),
            (None, None) => Err("neither `p` nor `w_sol` is given: the conversion is unknown".to_owned()),
        }
    }
}

/// Formats an error with the column and the value that it is about.
fn with_column(error: &Error, row: &Composition) -> String {
    let (column, value) = match error {
        Error::TooManyReacted { .. } => ("p", row.conversion),
        Error::NoGel { .. } if row.units.is_some() => ("x", row.units),
        Error::NoGel { .. } if row.conversion.is_some() => ("p", row.conversion),
        Error::NoGel { .. } | Error::TooLittleSol { .. } => ("w_sol", row.sol),
        Error::TooShort { .. } => ("M_strand_kg_mol", row.strand_mass),
        Error::Domain { quantity: "sol fraction", .. } => ("w_sol", row.sol),
        Error::Domain { quantity: "conversion p_A", .. } => ("p", row.conversion),
        _ => ("", None),
    };
    match value {
        Some(value) => format!("`{column}` = {value}: {error}"),
        None => error.to_string(),
    }
}

/// Network of a row, and the origin of its conversion.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkPrediction {
    /// The network.
    pub network: PolymerNetwork,
    /// Origin of the conversion.
    pub origin: &'static str,
}

/// Writes compositions with their predictions as CSV: the columns of the file, then those of the
/// prediction, which take the place of columns of the same name; a row to which the model does not apply has
/// its reason.
pub fn to_csv(table: &CompositionTable, predictions: &[Result<NetworkPrediction, String>]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let record = |writer: &mut csv::Writer<Vec<u8>>, cells: Vec<String>| {
        // into memory, and all records have the same length
        let _ = writer.write_record(cells);
    };
    let added = ADDED.map(str::to_owned).to_vec();
    let kept = |cells: &[String]| -> Vec<String> {
        let cells = cells.iter().zip(&table.headings);
        cells
            .filter(|(_, heading)| !ADDED.contains(&heading.as_str()))
            .map(|(cell, _)| cell.clone())
            .collect()
    };
    record(&mut writer, [kept(&table.headings), added].concat());
    for (row, prediction) in table.rows.iter().zip(predictions) {
        let mut cells = kept(&row.cells);
        match prediction {
            Err(reason) => {
                cells.extend(std::iter::repeat_n(String::new(), ADDED.len() - 1));
                cells.push(reason.clone());
            }
            Ok(NetworkPrediction { network, origin }) => {
                let digits = |value: f64| format_digits(value);
                let optional = |value: Option<f64>| value.map(digits).unwrap_or_default();
                let energy = network.fracture_energy();
                cells.extend(
                    [network.modulus(), network.phantom(), network.entangled()].map(|g| digits(g / 1e6)),
                );
                cells.push(digits(network.stiffening()));
                cells.push(digits(network.sol.mass));
                cells.push(optional(network.segments()));
                cells.push(optional(network.locking_stretch()));
                cells.extend([0, 1].map(|i| optional(energy.map(|range| range[i]))));
                cells.push(digits(network.conversion[0]));
                cells.push(optional(network.least_conversion));
                cells.push((*origin).to_owned());
                cells.push(optional(row.modulus.map(|modulus| network.modulus() / modulus - 1.0)));
                cells.push(String::new());
            }
        }
        record(&mut writer, cells);
    }
    let bytes = writer.into_inner().unwrap_or_default();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Formats a number with six digits.
fn format_digits(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse::<f64>().unwrap_or(value);
    match rounded == 0.0 || (1e-4..1e9).contains(&rounded.abs()) {
        true => format!("{rounded}"),
        false => format!("{rounded:e}"),
    }
}

/// Deviations of predicted from measured moduli, predicted/measured − 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviations {
    /// Rows.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Median of the amount.
    pub median: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Largest amount.
    pub largest: f64,
}

impl Deviations {
    /// Sums up deviations; `None` without any.
    pub fn new(deviations: impl IntoIterator<Item = f64>) -> Option<Self> {
        let all: Vec<f64> = deviations.into_iter().collect();
        let mut amounts: Vec<f64> = all.iter().map(|deviation| deviation.abs()).collect();
        amounts.sort_by(f64::total_cmp);
        let count = all.len();
        let largest = *amounts.last()?;
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / count as f64;
        Some(Self {
            count,
            mean: mean(&mut all.iter().copied()),
            median: (amounts[(count - 1) / 2] + amounts[count / 2]) / 2.0,
            rms: mean(&mut all.iter().map(|deviation| deviation * deviation)).sqrt(),
            largest,
        })
    }

    /// Sums up the deviations of rows with a prediction and a measured modulus that satisfy a condition.
    pub fn of_rows(
        table: &CompositionTable,
        predictions: &[Result<NetworkPrediction, String>],
        counts: impl Fn(&Composition) -> bool,
    ) -> Option<Self> {
        let rows = table.rows.iter().zip(predictions).filter(|(row, _)| counts(row));
        Self::new(
            rows.filter_map(|(row, found)| Some(found.as_ref().ok()?.network.modulus() / row.modulus? - 1.0)),
        )
    }
}
