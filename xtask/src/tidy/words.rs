//! Wording of the Rust sources: doc comments, names of functions, length of lines, names of types.

use std::collections::{BTreeMap, BTreeSet};

/// Words with which a doc comment must not begin: the reader learns what an item is only later.
const PRONOUNS: &str = "What Where Of Whether Its How Those That These This They It Which Who When As In By \
                        From With For At On To If So Into Whose Than Such There Here Thus Their One Both \
                        None Nothing Everything";

/// Largest share of doc comments that begin with such a word.
const MOST_PRONOUNS: f64 = 0.01;

/// Names that no public function has: prepositions, pronouns, auxiliaries, and words with several meanings.
const WORDS: &str = "own one told said laid lay held hold holds meets look looks has have had does leap \
                     still taken part know spend may yes place round release sever slack taut its for";

/// Names of one or two letters that are symbols of the field.
const SYMBOLS: [(&str, &str); 2] =
    [("ln", "natural logarithm"), ("si", "value in the International System of Units")];

/// Longest line, characters.
const LONGEST: usize = 110;

/// Largest number of type names that the workspace uses twice or more.
const MOST_SHARED: usize = 40;

/// Findings by rule.
#[derive(Default)]
pub struct WordCounts {
    /// Number of doc comments.
    comments: usize,
    pronouns: Vec<String>,
    functions: Vec<String>,
    lines: Vec<String>,
    /// Files that define a type, by its name.
    types: BTreeMap<String, BTreeSet<String>>,
}

impl WordCounts {
    /// Adds a source file of any crate.
    pub fn add(&mut self, file: &str, text: &str) {
        let mut in_tests = is_test(file);
        let mut in_comment = false;
        for (index, line) in text.lines().enumerate() {
            let (place, code) = (format!("{file}:{}", index + 1), line.trim_start());
            let comment = code.strip_prefix("///").or_else(|| code.strip_prefix("//!"));
            if let Some(comment) = comment
                && !in_comment
            {
                self.comments += 1;
                let word = first_word(comment.trim_start());
                if PRONOUNS.split_whitespace().any(|pronoun| pronoun == word) {
                    self.pronouns.push(format!("{place}: a doc comment begins with `{word}`"));
                }
            }
            in_comment = comment.is_some();
            if line.chars().count() > LONGEST && !is_one_word(code) {
                self.lines.push(format!("{place}: {} characters, at most {LONGEST}", line.chars().count()));
            }
            let item = without_visibility(code);
            in_tests |= ["mod tests", "mod test"]
                .iter()
                .any(|start| item.strip_prefix(start).is_some_and(|rest| first_word(rest).is_empty()));
            if in_tests {
                continue;
            }
            if item.len() < code.len()
                && let Some(name) = function_name(item)
                && is_unclear(name)
            {
                self.functions
                    .push(format!("{place}: the name of the public function `{name}` says too little"));
            }
            // types of modules alone: those within functions begin further right
            if code.len() == line.len()
                && let Some(name) = type_name(item)
            {
                self.types.entry(name.to_owned()).or_default().insert(file.to_owned());
            }
        }
    }

    /// Lists all findings of the rules that are broken.
    pub fn findings(&self) -> Vec<String> {
        let mut findings = [self.functions.clone(), self.lines.clone()].concat();
        if self.pronouns.len() as f64 > MOST_PRONOUNS * self.comments as f64 {
            findings.extend_from_slice(&self.pronouns);
        }
        let shared: Vec<String> = self
            .shared()
            .map(|(name, files)| {
                let files: Vec<&str> = files.iter().map(String::as_str).collect();
                format!("type `{name}` is defined in {}", files.join(", "))
            })
            .collect();
        if shared.len() > MOST_SHARED {
            findings.extend(shared);
        }
        findings
    }

    /// Summarises the four counts in one line.
    pub fn summary(&self) -> String {
        let share = 100.0 * self.pronouns.len() as f64 / self.comments.max(1) as f64;
        format!(
            "words: {share:.2} % of {} doc comments begin with a pronoun (at most {} %), {} unclear function \
             names (0), {} lines above {LONGEST} characters (0), {} shared type names (at most \
             {MOST_SHARED})\n",
            self.comments,
            100.0 * MOST_PRONOUNS,
            self.functions.len(),
            self.lines.len(),
            self.shared().count(),
        )
    }

    fn shared(&self) -> impl Iterator<Item = (&String, &BTreeSet<String>)> {
        self.types.iter().filter(|(_, files)| files.len() > 1)
    }
}

/// Returns true for files whose types and functions are not part of a library.
fn is_test(file: &str) -> bool {
    let folders = ["tests/", "examples/", "benches/"];
    let in_folder =
        folders.iter().any(|folder| file.starts_with(folder) || file.contains(&format!("/{folder}")));
    in_folder || file.ends_with("tests.rs")
}

fn is_unclear(name: &str) -> bool {
    let is_symbol = SYMBOLS.iter().any(|(symbol, _)| *symbol == name);
    !is_symbol && (name.chars().count() <= 2 || WORDS.split_whitespace().any(|word| word == name))
}

/// Returns true for a line that cannot be broken: a URL, an attribute or a number alone.
fn is_one_word(code: &str) -> bool {
    let text = code.trim_start_matches(['/', '!']).trim();
    !text.contains(char::is_whitespace)
}

/// Letters, digits and `_` with which a text begins.
fn first_word(text: &str) -> &str {
    let end = text.find(|letter: char| !letter.is_alphanumeric() && letter != '_').unwrap_or(text.len());
    &text[..end]
}

/// Returns the item behind `pub` or `pub(…)`, or the whole text if it is private.
fn without_visibility(code: &str) -> &str {
    let Some(rest) = code.strip_prefix("pub") else { return code };
    let rest = match rest.strip_prefix('(') {
        Some(scope) => scope.split_once(')').map_or(rest, |(_, rest)| rest),
        None => rest,
    };
    rest.strip_prefix(' ').unwrap_or(code)
}

fn function_name(mut item: &str) -> Option<&str> {
    while let Some(rest) = ["const ", "unsafe ", "async "].iter().find_map(|word| item.strip_prefix(word)) {
        item = rest;
    }
    item.strip_prefix("fn ").map(first_word)
}

fn type_name(item: &str) -> Option<&str> {
    let keywords = ["struct ", "enum ", "trait ", "union ", "type "];
    keywords.iter().find_map(|keyword| item.strip_prefix(keyword)).map(first_word)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(files: &[(&str, &str)]) -> WordCounts {
        let mut words = WordCounts::default();
        files.iter().for_each(|(file, text)| words.add(file, text));
        words
    }

    #[test]
    fn doc_comments() {
        let text = "//! What it is.\n//! Where it is.\n\n/// Returns x.\nfn a() {}\n    /// Italian.\n// As \
                    before\n";
        let found = words(&[("a.rs", text)]);
        assert_eq!((found.comments, found.pronouns.len()), (3, 1));
        assert_eq!(found.findings(), ["a.rs:1: a doc comment begins with `What`"]);
        // one of a hundred is allowed
        let many = "/// Returns x.\nfn a() {}\n".repeat(97);
        let found = words(&[("a.rs", text), ("b.rs", &many)]);
        assert_eq!((found.comments, found.findings().len()), (100, 0));
    }

    #[test]
    fn functions() {
        let text = "impl A {\n    pub(super) const fn of() {}\n    pub fn si() {}\n    fn at() {}\n    pub \
            fn told() {}\n\
                    pub fn office() {}\n}\n#[cfg(test)]\nmod tests {\n    pub fn of() {}\n}\n";
        let found = words(&[("crates/a/src/a.rs", text), ("crates/a/tests/b.rs", text)]).findings();
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].starts_with("crates/a/src/a.rs:2: ") && found[0].contains("`of`"), "{found:?}");
        assert!(found[1].contains("`told`"), "{found:?}");
    }

    #[test]
    fn lines() {
        let exact = format!("// {} b\n", "ä".repeat(LONGEST - 5));
        assert_eq!(words(&[("a.rs", &exact)]).findings(), [""; 0]);
        let longer = exact.replace(" b", " bc");
        assert_eq!(words(&[("a.rs", &longer)]).findings(), ["a.rs:1: 111 characters, at most 110"]);
        // a URL alone cannot be broken
        let address = format!("    /// <https://example.org/{}>\n", "a".repeat(110));
        assert_eq!(words(&[("a.rs", &address)]).findings(), [""; 0]);
    }

    #[test]
    fn types() {
        let names: Vec<String> = (0..=MOST_SHARED).map(|k| format!("pub struct T{k};\n")).collect();
        let all = names.concat();
        let twice = words(&[("a/src/a.rs", &all), ("b/src/b.rs", &all)]);
        assert_eq!(twice.findings().len(), MOST_SHARED + 1);
        assert_eq!(twice.findings()[0], "type `T0` is defined in a/src/a.rs, b/src/b.rs");
        assert!(twice.summary().contains("41 shared type names (at most 40)"), "{}", twice.summary());
        let fewer = names[1..].concat();
        assert_eq!(words(&[("a/src/a.rs", &all), ("b/src/b.rs", &fewer)]).findings(), [""; 0]);
        // within functions, in tests, or twice in one file
        let inner = "fn f() {\n    struct T1;\n}\nmod tests {\n}\nstruct T2;\n";
        assert_eq!(
            words(&[("a/src/a.rs", &all), ("b/src/b.rs", inner), ("b/tests/c.rs", &all)]).shared().count(),
            0
        );
    }
}
