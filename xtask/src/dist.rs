//! The archive of a release for one system: programs, completions, man pages, licences.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use flate2::Compression;
use flate2::write::GzEncoder;
use miette::{IntoDiagnostic, Result, WrapErr, miette};

use crate::licences;
use crate::table::print;
use crate::workspace::Repository;

/// Files of the tree that an archive contains.
const FILES: [&str; 5] = ["README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE-APACHE", "LICENSE-MIT"];
/// Shells and the names of their completions.
const SHELLS: [(&str, &str, &str); 5] = [
    ("bash", "", ""),
    ("zsh", "_", ""),
    ("fish", "", ".fish"),
    ("powershell", "_", ".ps1"),
    ("elvish", "", ".elv"),
];

/// Options of `cargo xtask dist`.
#[derive(clap::Args)]
pub struct Options {
    /// Folder for the archive; default: target/dist.
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Take the programs of this folder instead of building them.
    #[arg(long, value_name = "DIR")]
    from: Option<PathBuf>,
    /// Name of the system in the archive's name; default: this one's.
    #[arg(long, value_name = "TRIPLE")]
    target: Option<String>,
}

/// Writes `polymer-mechanics-VERSION-TRIPLE.tar.gz` and prints its path.
pub fn run(workspace: &Repository, options: &Options) -> Result<bool> {
    let programs = workspace.programs();
    let mut executables = Vec::new();
    for program in &programs {
        executables.push(match &options.from {
            Some(folder) => folder.join(program).with_extension(std::env::consts::EXE_EXTENSION),
            None => workspace.build_program(program)?,
        });
    }
    let triple = options.target.clone().map_or_else(host, Ok)?;
    let folder = options.output.clone().map_or_else(|| workspace.results("dist"), Ok)?;
    fs::create_dir_all(&folder).into_diagnostic().wrap_err_with(|| folder.display().to_string())?;
    let name = format!("polymer-mechanics-{}-{triple}", env!("CARGO_PKG_VERSION"));
    let staging = tempfile::tempdir_in(&folder).into_diagnostic()?;
    let root = staging.path().join(&name);
    let file = |place: &str, bytes: &[u8]| -> Result<()> {
        let path = root.join(place);
        let parent = path.parent().unwrap_or(&root);
        fs::create_dir_all(parent)
            .and_then(|()| fs::write(&path, bytes))
            .into_diagnostic()
            .wrap_err(path.display().to_string())
    };
    for (program, executable) in programs.iter().zip(&executables) {
        let place = root.join("bin").join(executable.file_name().unwrap_or_default());
        fs::create_dir_all(root.join("bin"))
            .and_then(|()| fs::copy(executable, &place))
            .into_diagnostic()
            .wrap_err_with(|| executable.display().to_string())?;
        for (shell, before, after) in SHELLS {
            let script = run_program(executable, &["completions", shell])?;
            file(&format!("completions/{shell}/{before}{program}{after}"), &script)?;
        }
        let pages = root.join("man/man1");
        fs::create_dir_all(&pages).into_diagnostic()?;
        run_program(executable, &["man", &pages.display().to_string()])?;
    }
    for name in FILES {
        let path = workspace.root().join(name);
        file(name, &fs::read(&path).into_diagnostic().wrap_err_with(|| path.display().to_string())?)?;
    }
    file("THIRD-PARTY.md", licences::text(workspace, &programs)?.as_bytes())?;
    let archive = folder.join(format!("{name}.tar.gz"));
    pack(&root, &name, &archive)?;
    print(&format!("{}\n", workspace.short(&archive)));
    Ok(true)
}

/// Returns the output of a program.
fn run_program(executable: &Path, arguments: &[&str]) -> Result<Vec<u8>> {
    let output = Command::new(executable)
        .args(arguments)
        .output()
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot start {}", executable.display()))?;
    if !output.status.success() {
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(miette!("{} {}: {complaint}", executable.display(), arguments.join(" ")));
    }
    Ok(output.stdout)
}

/// Writes an archive of a folder under another name and renames it.
fn pack(root: &Path, name: &str, archive: &Path) -> Result<()> {
    let temporary = archive.with_extension("part");
    let write = || -> std::io::Result<()> {
        let mut builder =
            tar::Builder::new(GzEncoder::new(fs::File::create(&temporary)?, Compression::best()));
        builder.append_dir_all(name, root)?;
        builder.into_inner()?.finish()?.flush()?;
        fs::rename(&temporary, archive)
    };
    write().into_diagnostic().wrap_err_with(|| archive.display().to_string())
}

/// Target triple of this compiler, from `rustc -vV`.
fn host() -> Result<String> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc).arg("-vV").output().into_diagnostic().wrap_err("cannot start rustc")?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).ok_or_else(|| miette!("`rustc -vV` does not name its host"))
}
