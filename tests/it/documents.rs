//! Commands and links of README and docs: cheap commands are run, the others must at least be accepted.

use crate::program::{command, finish, workspace};
use std::fs;
use std::path::{Path, PathBuf};

/// Programs that documents may show, besides `xtask`.
const PROGRAMS: [&str; 4] = ["crystfem", "mdsurrogate", "peri", "polycore"];

/// A command line in a document.
#[derive(Debug)]
pub struct Shown {
    file: PathBuf,
    line: usize,
    /// Program and arguments.
    pub words: Vec<String>,
}

/// README and everything below docs.
fn documents() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> =
        ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| workspace().join(name)).into();
    let mut folders = vec![workspace().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.push(path);
            }
        }
    }
    found.retain(|path| path.extension().is_some_and(|extension| extension == "md") && path.is_file());
    found.sort();
    found
}

/// Collects commands in fences marked as shell; a backslash joins lines; output, comments and other languages
/// are left out.
pub fn commands_of(file: &Path) -> Vec<Shown> {
    let text = fs::read_to_string(file).unwrap();
    let (mut shown, mut shell, mut inside) = (Vec::new(), false, false);
    let mut joined = String::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if let Some(language) = line.strip_prefix("```") {
            inside = !inside;
            shell = inside && ["sh", "bash", "shell", "console"].contains(&language.trim());
            continue;
        }
        if !shell {
            continue;
        }
        joined += line.strip_prefix("$ ").unwrap_or(line);
        if joined.ends_with('\\') {
            joined.pop();
            continue;
        }
        for part in parts(&joined) {
            shown.push(Shown { file: file.to_path_buf(), line: index + 1, words: part });
        }
        joined.clear();
    }
    shown
}

/// Splits a shell line into the words of its commands, without comments, redirections and assignments.
fn parts(line: &str) -> Vec<Vec<String>> {
    let mut parts = vec![Vec::new()];
    let (mut word, mut quote, mut quoted) = (String::new(), None, false);
    for letter in line.chars().chain([' ']) {
        match (letter, quote) {
            ('\'' | '"', None) => (quote, quoted) = (Some(letter), true),
            (_, Some(open)) if letter == open => quote = None,
            (' ' | '\t', None) if word.is_empty() && !quoted => {}
            (' ' | '\t', None) => {
                let word = std::mem::take(&mut word);
                match word.as_str() {
                    _ if quoted => parts.last_mut().unwrap().push(word),
                    "|" | "&&" | "||" | ";" => parts.push(Vec::new()),
                    _ if word.starts_with('#') => break,
                    _ => parts.last_mut().unwrap().push(word),
                }
                quoted = false;
            }
            _ => word.push(letter),
        }
    }
    for part in &mut parts {
        if let Some(redirection) =
            part.iter().position(|word| word.starts_with('>') || word.starts_with("2>"))
        {
            part.truncate(redirection);
        }
        while part.first().is_some_and(|word| word.contains('=') && !word.starts_with('-')) {
            part.remove(0);
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// Returns which of our programs a command runs, and its arguments.
pub fn ours(words: &[String]) -> Option<(&str, Vec<&str>)> {
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["cargo", "xtask", ..] => Some(("xtask", words[2..].to_vec())),
        ["cargo", "run", ..] => {
            let end = words.iter().position(|&word| word == "--").unwrap_or(words.len());
            let package = words[..end].iter().find_map(|word| word.strip_prefix("--package="));
            let after = |flag: &str| {
                words[..end].iter().position(|&w| w == flag).and_then(|at| words.get(at + 1)).copied()
            };
            let package = package.or(after("-p")).or(after("--package")).or(after("--bin"))?;
            let package = package.strip_suffix("-cli").unwrap_or(package);
            Some((package, words.get(end + 1..).unwrap_or_default().to_vec()))
        }
        [program, ..] => {
            let name = program.rsplit('/').next().unwrap_or(program);
            PROGRAMS.contains(&name).then(|| (name, words[1..].to_vec()))
        }
        [] => None,
    }
}

/// Creates a directory in which documents' relative paths are valid and results do no harm.
fn playground() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(workspace()).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name();
        if ["target", "out", ".git"].iter().all(|&hidden| name != hidden) {
            #[cfg(unix)]
            std::os::unix::fs::symlink(entry.path(), directory.path().join(name)).unwrap();
        }
    }
    directory
}

#[test]
#[cfg(unix)]
fn commands_shown_are_understood() {
    let playground = playground();
    let (mut faults, mut known) = (Vec::new(), 0);
    for shown in documents().iter().flat_map(|file| commands_of(file)) {
        let place = format!("{}:{}: {}", shown.file.display(), shown.line, shown.words.join(" "));
        let Some((program, arguments)) = ours(&shown.words) else { continue };
        if program != "xtask" && !PROGRAMS.contains(&program) {
            faults.push(format!("{place}: there is no program `{program}`"));
            continue;
        }
        known += 1;
        let cheap = match arguments.first() {
            Some(&("exact" | "check" | "completions" | "--help" | "--version" | "help")) => {
                program != "xtask"
            }
            _ => false,
        };
        for argument in arguments.iter().filter(|argument| argument.ends_with(".toml")) {
            // a scene that the document asks its reader to write
            let is_example = !argument.contains('/');
            if !is_example && !playground.path().join(argument).is_file() {
                faults.push(format!("{place}: there is no {argument}"));
            }
        }
        let missing_example = arguments.iter().any(|a| a.ends_with(".toml") && !a.contains('/'));
        let mut run = command(program, "", playground.path());
        // arguments are parsed from left to right, and help ends the parsing before a run
        let end = arguments.iter().position(|argument| *argument == "--").unwrap_or(arguments.len());
        run.args(&arguments[..end]);
        if !cheap || missing_example {
            run.arg("--help");
        }
        run.args(&arguments[end..]);
        let ended = finish(run.spawn().unwrap());
        if ended.code != Some(0) {
            faults.push(format!("{place}: exit code {:?}\n{}", ended.code, ended.stderr));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(known >= 10, "only {known} commands were found");
}

/// Links and pictures of documents that do not lead to the web lead to existing files.
#[test]
fn links_lead_to_files() {
    let mut faults = Vec::new();
    for file in documents() {
        let text = fs::read_to_string(&file).unwrap();
        let mut inside = false;
        for (index, line) in text.lines().enumerate() {
            inside ^= line.trim_start().starts_with("```");
            if inside {
                continue;
            }
            for target in line.split("](").skip(1).filter_map(|rest| rest.split([')', ' ', '#']).next()) {
                let elsewhere = target.is_empty() || target.contains(':') || target.contains('`');
                if !elsewhere && !file.parent().unwrap().join(target).exists() {
                    faults.push(format!("{}:{}: there is no {target}", file.display(), index + 1));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Examples of the libraries are doctests of the crates, in the head of a `lib.rs`, or programs in their
/// `examples` ([`crate::examples`] runs them), which the page repeats.
#[test]
fn rust_examples_are_doctests_or_programs() {
    let heads: Vec<String> = ["peri", "mdsurrogate"]
        .map(|name| {
            let text = fs::read_to_string(workspace().join(format!("crates/{name}/src/lib.rs"))).unwrap();
            let lines = text.lines().map_while(|line| line.strip_prefix("//!"));
            let lines = lines.map(|line| line.strip_prefix(' ').unwrap_or(line));
            // lines that rustdoc hides
            lines.filter(|line| !line.starts_with("# ")).collect::<Vec<_>>().join("\n")
        })
        .into();
    let page = fs::read_to_string(workspace().join("docs/guide/src/how-to/library.md")).unwrap();
    let mut programs = 0;
    let parts: Vec<&str> = page.split("```rust\n").collect();
    for (before, after) in parts.iter().zip(&parts[1..]) {
        let fence = after.split("\n```").next().unwrap();
        let marker = before.trim_end().lines().next_back().and_then(|line| line.strip_prefix("<!-- file: "));
        if let Some(file) = marker.and_then(|rest| rest.strip_suffix(" -->")) {
            let text = fs::read_to_string(workspace().join(file)).unwrap();
            // visible to the tests that include it
            let text = text.replace("\npub(crate) fn main", "\nfn main");
            assert!(file.contains("/examples/") && text.trim_end() == fence, "{file}");
            programs += 1;
            continue;
        }
        let there = |head: &String| head.contains(&format!("```\n{fence}\n```"));
        assert!(heads.iter().any(there), "no doctest is\n{fence}");
    }
    assert!(programs >= 4 && parts.len() > programs + 1, "{programs} of {}", parts.len());
}

/// Pages that SUMMARY.md does not name are missing from the book.
#[test]
fn every_page_is_in_the_summary() {
    let guide = workspace().join("docs/guide/src");
    let summary = fs::read_to_string(guide.join("SUMMARY.md")).unwrap();
    let named: Vec<PathBuf> = summary
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next())
        .map(|target| guide.join(target))
        .collect();
    for page in &named {
        let text = fs::read_to_string(page).unwrap_or_else(|error| panic!("{}: {error}", page.display()));
        assert!(text.starts_with("# "), "{}: a page begins with its heading", page.display());
    }
    let pages =
        documents().into_iter().filter(|page| page.starts_with(&guide) && !page.ends_with("SUMMARY.md"));
    let missing: Vec<PathBuf> = pages.filter(|page| !named.contains(page)).collect();
    assert!(missing.is_empty(), "not in SUMMARY.md: {missing:?}");
    assert!(named.len() > 20, "{}", named.len());
}

#[test]
fn shell_lines_are_cut_into_words() {
    let words = |line: &str| parts(line).iter().map(|part| part.join("|")).collect::<Vec<_>>();
    assert_eq!(
        words("cargo run --release --bin peri -- run a.toml  # main job"),
        ["cargo|run|--release|--bin|peri|--|run|a.toml"]
    );
    assert_eq!(
        words("A=1 peri check 'a b.toml' > log && peri exact law | head"),
        ["peri|check|a b.toml", "peri|exact|law", "head"]
    );
    let line: Vec<String> = ["cargo", "run", "-p", "peri", "--", "run", "x"].map(String::from).into();
    assert_eq!(ours(&line), Some(("peri", vec!["run", "x"])));
}
