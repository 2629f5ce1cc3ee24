//! Shared parts of all command lines: exit codes, progress, threads, folder of the results.

use super::Fault;
use crate::scene::Failure;
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between lines of progress where there is no terminal.
const LOG_EVERY: Duration = Duration::from_secs(10);

/// True if standard output took less than was printed.
static CUT_SHORT: AtomicBool = AtomicBool::new(false);

/// Prints a line to standard output as `println!` does, but without its panic: a reader that has seen enough
/// (`| head`) is no reason to fail; what else goes wrong, a full disk for example, is said once and makes
/// [`exit`] fail.
///
/// [`exit`]: crate::case::terminal::exit
#[macro_export]
macro_rules! say {
    ($($part:tt)*) => {
        $crate::case::terminal::print(format_args!("{}\n", format_args!($($part)*)))
    };
}

/// Prints a text to standard output as [`say!`](crate::say) does.
pub fn print(text: impl Display) {
    let mut output = std::io::stdout().lock();
    match write!(output, "{text}").and_then(|()| output.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe && !CUT_SHORT.swap(true, Ordering::Relaxed) => {
            complain(format_args!("error: cannot write to standard output: {error}\n"));
        }
        _ => {}
    }
}

/// Prints a text to standard error, if that can be.
pub fn complain(text: impl Display) {
    let _ = write!(std::io::stderr(), "{text}");
}

/// Longest line of a summary, in columns.
pub(super) const WIDTH: usize = 100;

/// Colours and width of standard output.
#[derive(Clone, Copy, Debug)]
pub(super) struct TerminalStyle {
    colors: bool,
    /// Columns that a line may take.
    pub width: usize,
}

impl TerminalStyle {
    /// Returns the style of standard output: no colours if it is no terminal or `NO_COLOR` is set.
    pub fn of_output() -> Self {
        let terminal = std::io::stdout().is_terminal();
        let size = console::Term::stdout().size_checked().filter(|_| terminal);
        let width = size.map_or(WIDTH, |(_, columns)| usize::from(columns).clamp(40, WIDTH));
        Self { colors: terminal && std::env::var_os("NO_COLOR").is_none(), width }
    }

    /// Returns the style of a file.
    #[cfg(test)]
    pub fn plain() -> Self {
        Self { colors: false, width: WIDTH }
    }

    fn paint(&self, code: u8, text: &str) -> String {
        match self.colors && !text.is_empty() {
            true => format!("\x1b[{code}m{text}\x1b[0m"),
            false => text.to_owned(),
        }
    }

    pub fn bold(&self, text: &str) -> String {
        self.paint(1, text)
    }

    pub fn red(&self, text: &str) -> String {
        self.paint(31, text)
    }

    pub fn green(&self, text: &str) -> String {
        self.paint(32, text)
    }

    pub fn yellow(&self, text: &str) -> String {
        self.paint(33, text)
    }

    /// Cuts a line to the width.
    pub fn fitted(&self, line: &str) -> String {
        match line.char_indices().nth(self.width) {
            Some(_) => line.chars().take(self.width - 1).chain("…".chars()).collect(),
            None => line.to_owned(),
        }
    }

    /// Breaks a line between words; further lines are indented.
    pub fn wrapped(&self, line: &str) -> String {
        if line.chars().count() <= self.width {
            return format!("{line}\n");
        }
        let indent = line.len() - line.trim_start().len();
        let mut text = " ".repeat(indent);
        let mut column = indent;
        for word in line.split_whitespace() {
            let length = word.chars().count();
            if column > indent && column + 1 + length > self.width {
                text += &format!("\n{}", " ".repeat(indent + 2));
                column = indent + 2;
            } else if column > indent {
                text.push(' ');
                column += 1;
            }
            text += word;
            column += length;
        }
        text + "\n"
    }
}

/// Returns the exit code of a command that tells whether it passed; a failure is printed.
pub fn exit<E: Fault>(result: Result<bool, Failure<E>>) -> ExitCode {
    match result {
        Ok(true) if !CUT_SHORT.load(Ordering::Relaxed) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(Failure::Scene(error)) => {
            complain(error.render());
            ExitCode::from(error.exit_code())
        }
        Err(Failure::Run(error)) => {
            complain(format_args!("error: {error}\n"));
            ExitCode::from(error.exit_code())
        }
    }
}

/// `cases/ch2/plate-with-hole/case.toml` → `out/plate-with-hole`.
pub fn default_output(scene: &Path) -> PathBuf {
    let stem = scene.file_stem().unwrap_or_default();
    let folder = scene.parent().and_then(Path::file_name);
    let name = if stem == "case" { folder.unwrap_or(stem) } else { stem };
    Path::new("out").join(name)
}

/// Returns whether the run of an output folder is finished (it has a report and no checkpoint), and prints
/// so.
pub fn is_finished(output: &Path) -> bool {
    let there = |name: &str| output.join(name).is_file();
    let finished = !there(crate::checkpoint::FILE_NAME) && there(crate::report::FILE_NAME);
    if finished {
        say!("{} is finished: nothing to resume", output.display());
    }
    finished
}

/// Returns a command line on which negative numbers are values and no options: the range of each is then
/// told.
pub(super) fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let takes = |arg: clap::Arg| match arg.get_action().takes_values() {
        true => arg.allow_negative_numbers(true),
        false => arg,
    };
    command.mut_args(takes).mut_subcommands(with_negative_numbers)
}

/// Parses a time in seconds, for clap.
///
/// # Errors
/// The text is not a number, or none of 0 to 1e9.
pub fn seconds(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    if (0.0..=1e9).contains(&value) { Ok(value) } else { Err(format!("{value} is not within 0 to 1e9")) }
}

/// The option `--threads`.
#[derive(clap::Args)]
pub struct Threads {
    /// Number of threads; default: all. The results are bit-identical.
    // the same place in the help of every program
    #[arg(long, global = true, display_order = 100, value_parser = clap::value_parser!(u16).range(1..=4096))]
    threads: Option<u16>,
}

impl Threads {
    /// Makes the thread pool of the program.
    ///
    /// # Errors
    /// The system does not give so many threads.
    pub fn apply(&self) -> Result<(), String> {
        let threads = self.threads.map_or(0, usize::from);
        // the main thread is one of them: a parallel loop that it begins need not wake another to be begun
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).use_current_thread();
        pool.build_global()
            .map_err(|error| format!("cannot start threads: {error}; --threads N asks for fewer"))
    }
}

/// Returns a function that is true once the user has asked to stop (Ctrl-C, SIGTERM) since the first call.
pub fn interrupted() -> &'static (dyn Fn() -> bool + Sync) {
    static STOP: AtomicBool = AtomicBool::new(false);
    // a second handler cannot be set; the first does the same
    let _ = ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed));
    &|| STOP.load(Ordering::Relaxed)
}

/// Progress of a long run: a bar on a terminal, a line now and then in a log file.
pub struct Progress {
    bar: ProgressBar,
    logged: Instant,
}

impl Progress {
    /// Returns a bar that shows nothing yet.
    pub fn start() -> Self {
        let bar = match std::io::stderr().is_terminal() {
            true => ProgressBar::new(1000),
            false => ProgressBar::hidden(),
        };
        let style =
            ProgressStyle::with_template("{spinner} {bar:30} {elapsed} (about {eta} left) {wide_msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { bar, logged: Instant::now() }
    }

    /// Shows the fraction done, 0 to 1, and a message.
    pub fn show(&mut self, part: f64, message: impl FnOnce() -> String) {
        if !self.bar.is_hidden() {
            self.bar.set_position((1000.0 * part) as u64);
            self.bar.set_message(message());
        } else if self.logged.elapsed() >= LOG_EVERY {
            self.logged = Instant::now();
            complain(format_args!("{}\n", message()));
        }
    }

    /// Removes the bar.
    pub fn finish(self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_go_into_a_folder_of_the_case() {
        let outputs =
            ["cases/ch2/dent/case.toml", "mine/bar.toml", "bar.toml"].map(Path::new).map(default_output);
        assert_eq!(outputs, ["out/dent", "out/bar", "out/bar"].map(PathBuf::from));
    }

    #[test]
    fn negative_numbers_are_values() {
        #[derive(clap::Parser)]
        struct Line {
            #[command(subcommand)]
            verb: Verb,
        }
        #[derive(clap::Subcommand)]
        enum Verb {
            Run {
                #[arg(long, value_parser = seconds)]
                every: f64,
                #[arg(long)]
                quick: bool,
            },
        }
        let parse = |line: &[&str]| {
            with_negative_numbers(<Line as clap::CommandFactory>::command()).try_get_matches_from(line)
        };
        let told = |line: &[&str]| parse(line).unwrap_err().to_string();
        assert!(told(&["a", "run", "--every", "-1"]).contains("-1 is not within 0 to 1e9"));
        assert!(told(&["a", "run", "--every", "--quick"]).contains("a value is required"));
        let matches = parse(&["a", "run", "--every", "2", "--quick"]).unwrap();
        let Verb::Run { every, quick } =
            <Line as clap::FromArgMatches>::from_arg_matches(&matches).unwrap().verb;
        assert_eq!((every, quick), (2.0, true));
    }

    #[test]
    fn lines_are_broken_between_words() {
        let style = TerminalStyle { colors: false, width: 12 };
        assert_eq!(style.wrapped("  one two three four"), "  one two\n    three\n    four\n");
        assert_eq!(style.fitted("one two three four"), "one two thr…");
        assert_eq!(style.red("x"), "x");
        assert_eq!(TerminalStyle { colors: true, width: 12 }.red("x"), "\x1b[31mx\x1b[0m");
    }

    #[test]
    fn seconds_are_checked() {
        assert_eq!(seconds("1.5"), Ok(1.5));
        for wrong in ["-1", "NaN", "inf", "2e9", "1 s"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }
}
