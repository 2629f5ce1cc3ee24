//! `mdsurrogate eval`: evaluates laws on the data of a scene.

use crate::error::Error;
use crate::program::run::{NamedLaw, Prepared, judge_laws};
use crate::program::scene::Scene;
use crate::surrogate::Surrogate;
use harness::case::terminal::{default_output, print};
use harness::report::Report;
use harness::scene::{Failure, Source};
use std::path::{Path, PathBuf};

/// Laws to evaluate.
#[derive(clap::Args)]
pub struct Eval {
    /// Scene (TOML) with the data.
    scene: PathBuf,
    /// Laws (safetensors).
    #[arg(required = true)]
    laws: Vec<PathBuf>,
    /// Output directory; default: out/NAME-eval, after the folder of the scene.
    #[arg(long, short)]
    output: Option<PathBuf>,
}

impl Eval {
    /// Evaluates the laws.
    pub fn run(self) -> Result<bool, Failure<Error>> {
        let source = Source::read(&self.scene)?;
        let scene = source.parse::<Scene>()?;
        scene.check(&source)?;
        let laws = law_names(&self.laws).into_iter().zip(&self.laws);
        let laws = laws.map(|(name, path)| Ok((name, Surrogate::read(path)?)));
        let laws = laws.collect::<Result<Vec<_>, crate::Error>>()?;
        let data = Prepared::new(&source, &scene)?;
        let output = self.output.unwrap_or_else(|| {
            let plain = default_output(&self.scene);
            plain.with_file_name(format!("{}-eval", plain.file_name().unwrap_or_default().to_string_lossy()))
        });
        let _lock = harness::case::prepare_run(&output)?;
        let mut report = Report::new("mdsurrogate", env!("CARGO_PKG_VERSION"), &source.text);
        let named: Vec<NamedLaw> = laws
            .iter()
            .map(|(name, law)| NamedLaw { name, law, branches: &[], runs: &[], seconds: None, split: None })
            .collect();
        let table = judge_laws(&named, &data, &output, &mut report)?;
        report.threads(1).write(&output)?;
        print(report.table());
        for line in table {
            harness::say!("{line}");
        }
        harness::say!("results in {}", output.display());
        Ok(report.passed())
    }
}

/// Names laws by their files, with the folder for equal file names, and a number for equal folders.
fn law_names(laws: &[PathBuf]) -> Vec<String> {
    let text = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let plain: Vec<String> = laws.iter().map(|path| text(path.file_stem())).collect();
    let count = |names: &[String], name: &String| names.iter().filter(|other| *other == name).count();
    let folder = |path: &PathBuf| text(path.parent().and_then(Path::file_name));
    let longer: Vec<String> = (plain.iter().zip(laws))
        .map(
            |(name, path)| {
                if count(&plain, name) > 1 { format!("{}-{name}", folder(path)) } else { name.clone() }
            },
        )
        .collect();
    (longer.iter().enumerate())
        .map(|(k, name)| match count(&longer[..k], name) {
            0 => name.clone(),
            before => format!("{name}-{}", before + 1),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::law_names;

    #[test]
    fn equal_names_get_folder_and_number() {
        let found = |paths: &[&str]| law_names(&paths.iter().map(Into::into).collect::<Vec<_>>());
        assert_eq!(found(&["a/energy.safetensors", "b/ann.safetensors"]), ["energy", "ann"]);
        let same = ["a/energy.safetensors", "b/energy.safetensors", "b/ann.safetensors"];
        assert_eq!(found(&same), ["a-energy", "b-energy", "ann"]);
        assert_eq!(found(&["a/energy.safetensors", "a/energy.safetensors"]), ["a-energy", "a-energy-2"]);
    }
}
