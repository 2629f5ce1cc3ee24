//! Thesis map: every numbered figure and table with a result, and our result (cases/thesis.toml).

use std::collections::BTreeSet;
use std::fs;

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use serde::{Deserialize, Serialize};

use super::evidence::{CaseNumber, MeasuredNumbers, NumberRow, TestNumber, check, verdict};
use super::pictures::{Gallery, ReportPicture};
use crate::workspace::Repository;

/// Items that must have a row (issue 6): figures and tables with a result, and the appendices.
pub const NUMBERED: &[&str] = &[
    "Fig. 2.6",
    "Fig. 2.7",
    "Fig. 2.8",
    "Fig. 2.10",
    "Fig. 2.11",
    "Fig. 2.13",
    "Fig. 2.14",
    "Fig. 2.16",
    "Fig. 2.18",
    "Fig. 2.19",
    "Table 3.1",
    "Fig. 3.3",
    "Fig. 3.4",
    "Fig. 3.5",
    "Fig. 3.6",
    "Table 3.2",
    "Table 3.3",
    "Table 3.4",
    "Fig. 3.7",
    "Fig. 3.8",
    "Fig. 3.9",
    "Fig. 3.10",
    "Fig. 3.11",
    "Fig. 4.1",
    "Table 4.1",
    "Fig. 4.4",
    "Fig. 4.5",
    "Fig. 4.6",
    "Fig. 4.7",
    "Fig. 4.8",
    "Fig. 4.9",
    "Appendix A",
    "Appendix B",
];

/// Content of cases/thesis.toml.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThesisMap {
    /// Rows in the order of the thesis.
    pub row: Vec<ThesisRow>,
    /// Transfers from one program to another.
    #[serde(default)]
    pub link: Vec<ThesisRow>,
    /// Numbers that prove the rows of docs/errata.md.
    pub erratum: Vec<super::errata::Proof>,
}

/// Figure or table, or a link between scales.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThesisRow {
    /// `Fig. 2.7`, `Print to stress`.
    pub number: String,
    /// Title of the row.
    pub title: String,
    /// Result shown by the thesis, or transferred by a link.
    pub shows: String,
    /// Our result.
    pub ours: String,
    /// Claimed verdict; valid only if its numbers are met.
    pub verdict: Verdict,
    /// Difference, or the reason for which it cannot be reproduced.
    pub because: Option<String>,
    /// Case: `ch2/dent`.
    pub case: Option<String>,
    /// Quantities that the case expects.
    #[serde(default)]
    pub numbers: Vec<CaseNumber>,
    /// Numbers that tests measure.
    #[serde(default)]
    pub tests: Vec<TestNumber>,
    /// Pictures among the case's results; of each group the first that exists is shown.
    #[serde(default)]
    pub pictures: Vec<Vec<String>>,
}

/// Claim of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Agrees with the thesis.
    Reproduced,
    /// Verified against an external result (for a link).
    Verified,
    /// Differs, for the reason in `because`.
    Differs,
    /// Not reproducible from the text of the thesis; `because` says what is missing.
    NotFromTheText,
    /// Not done yet; `because` says what is missing.
    Open,
}

/// Row with its results.
#[derive(Serialize)]
pub struct RowVerdict {
    number: String,
    title: String,
    shows: String,
    ours: String,
    because: Option<String>,
    /// Text for readers: `reproduced`.
    verdict: &'static str,
    /// Class on the page: `good`, `fair`, `bad`, `open`.
    tone: &'static str,
    findings: Vec<NumberRow>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pictures: Vec<ReportPicture>,
    case: Option<String>,
    anchor: String,
}

impl RowVerdict {
    /// Cells of the row in docs/validation.md.
    pub fn cells(&self) -> [String; 4] {
        let numbers: Vec<String> = self.findings.iter().map(|f| format!("{}: {}", f.what, f.value)).collect();
        let because = self.because.as_ref().map(|text| format!(": {text}")).unwrap_or_default();
        [self.number.clone(), self.title.clone(), numbers.join("; "), format!("{}{because}", self.verdict)]
    }

    /// Text for readers: `reproduced`.
    pub fn verdict(&self) -> &'static str {
        self.verdict
    }

    /// Removes the pictures, which are for the page only.
    pub fn without_pictures(mut self) -> Self {
        self.pictures.clear();
        self
    }
}

impl ThesisMap {
    /// Reads cases/thesis.toml.
    pub fn read(workspace: &Repository) -> Result<Self> {
        let path = workspace.root().join("cases/thesis.toml");
        let text = fs::read_to_string(&path).into_diagnostic().wrap_err("cases/thesis.toml")?;
        toml::from_str(&text).map_err(|error| miette!("cases/thesis.toml: {error}"))
    }

    /// Checks that every row appears once and refers to something that exists; returns the defects.
    pub fn faults(&self, workspace: &Repository) -> Vec<String> {
        let mut faults = Vec::new();
        let mut seen = BTreeSet::new();
        for row in self.row.iter().chain(&self.link) {
            let mut fault = |text: String| faults.push(format!("{}: {text}", row.number));
            if !seen.insert(row.number.as_str()) {
                fault("is listed twice".to_owned());
            }
            let plain = matches!(row.verdict, Verdict::Reproduced | Verdict::Verified);
            if !plain && row.because.as_deref().unwrap_or_default().is_empty() {
                fault("does not say why (`because`)".to_owned());
            }
            let because = row.because.as_deref().unwrap_or_default();
            let judged = row.numbers.iter().filter(|number| number.judged).count();
            let numbers = judged + row.tests.len();
            if numbers == 0 && !because.contains(|c: char| c.is_ascii_digit()) {
                fault("has a verdict and no number".to_owned());
            }
            if numbers == 0 && (plain || row.verdict == Verdict::Differs) {
                fault("claims a result without a quantity or a test".to_owned());
            }
            check(workspace, row.case.as_deref(), &row.numbers, &row.tests, &mut fault);
        }
        let missing = NUMBERED.iter().filter(|number| !seen.contains(*number));
        faults.extend(missing.map(|number| format!("{number}: has no row")));
        faults
    }

    /// Evaluates all rows: figures and tables, and links.
    pub fn judge(&self, found: &MeasuredNumbers, gallery: &mut Gallery) -> [Vec<RowVerdict>; 2] {
        [&self.row, &self.link].map(|rows| rows.iter().map(|row| row.judge(found, gallery)).collect())
    }
}

impl ThesisRow {
    fn judge(&self, found: &MeasuredNumbers, gallery: &mut Gallery) -> RowVerdict {
        let findings = found.findings(self.case.as_deref(), &self.numbers, &self.tests);
        let (verdict, tone) = match (self.verdict, verdict(&findings)) {
            (_, Some(failed @ ("failed", _))) => failed,
            (Verdict::NotFromTheText, _) => ("not reproducible from the text", "fair"),
            (Verdict::Open, _) => ("not yet", "open"),
            (_, Some(unbacked)) => unbacked,
            (Verdict::Reproduced, None) => ("reproduced", "good"),
            (Verdict::Verified, None) => ("verified", "good"),
            (Verdict::Differs, None) => ("reproduced with a stated difference", "fair"),
        };
        let outcome = found.outcomes.iter().find(|outcome| Some(&outcome.case) == self.case.as_ref());
        let shown = |group: &Vec<String>| {
            let outcome = outcome?;
            group.iter().find_map(|name| gallery.picture(outcome, name))
        };
        RowVerdict {
            pictures: self.pictures.iter().filter_map(shown).collect(),
            number: self.number.clone(),
            title: self.title.clone(),
            shows: self.shows.clone(),
            ours: self.ours.clone(),
            because: self.because.clone(),
            verdict,
            tone,
            findings,
            case: self.case.clone(),
            anchor: super::anchor(&self.number),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn workspace() -> Repository {
        Repository::new(std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".."))
    }

    /// Every figure and table has a row, and every row a quantity that a case expects or a test that measures
    /// it.
    #[test]
    fn the_map_is_whole() {
        let map = ThesisMap::read(&workspace()).expect("cases/thesis.toml");
        let faults = map.faults(&workspace());
        assert!(faults.is_empty(), "{}", faults.join("\n"));
        let errata = super::super::errata::Erratum::read(&workspace()).expect("docs/errata.md");
        assert!(errata.len() > 30, "{}", errata.len());
        let faults = super::super::errata::faults(&workspace(), &errata, &map.erratum);
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }

    #[test]
    fn faults_are_found() {
        let row = |text: &str| {
            let head = "erratum = []\n[[row]]\nnumber = 'Fig. 2.7'\ntitle = 't'\nshows = 's'\nours = 'o'\n";
            let map: ThesisMap = toml::from_str(&format!("{head}{text}")).expect("a map");
            map.faults(&workspace())
                .into_iter()
                .filter(|fault| fault.starts_with("Fig. 2.7:"))
                .collect::<Vec<_>>()
        };
        assert_eq!(row("verdict = 'differs'").len(), 3);
        assert_eq!(row("verdict = 'not-from-the-text'\nbecause = '38,000 atoms'"), [""; 0]);
        let number = "verdict = 'reproduced'\ncase = 'ch2/dent'\nnumbers = [{ what = 'w', quantity = 'no' }]";
        assert_eq!(row(number), ["Fig. 2.7: ch2/dent expects no `no`"]);
        let test = "verdict = 'reproduced'\ntests = [{ record = 'no such', what = 'w' }]";
        assert_eq!(row(test), ["Fig. 2.7: no test in crates/ measures \"no such\""]);
    }

    /// A row that relies on our own earlier figures alone is refused.
    #[test]
    fn regressions_are_no_evidence() {
        let root = tempfile::tempdir().expect("a folder");
        let workspace = Repository::new(root.path().to_path_buf());
        fs::create_dir_all(root.path().join("cases/c")).expect("a folder");
        let faults = |kinds: &[&str]| {
            let expect = |kind: &&str| {
                format!("[[expect]]\nquantity = 'q'\nat_most = 1\nsource = 's'\nkind = '{kind}'\n")
            };
            let text: String = kinds.iter().map(expect).collect();
            fs::write(root.path().join("cases/c/case.toml"), text).expect("a case");
            let number: CaseNumber = toml::from_str("quantity = 'q'\nwhat = 'w'").expect("a number");
            let mut faults = Vec::new();
            check(&workspace, Some("c"), &[number], &[], &mut |text| faults.push(text));
            faults
        };
        assert_eq!(faults(&["bound"]), [""; 0]);
        assert_eq!(faults(&["regression", "published"]), [""; 0]);
        assert!(faults(&["regression"])[0].contains("own earlier figures"));
    }
}
