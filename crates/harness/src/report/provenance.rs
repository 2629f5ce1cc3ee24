//! Provenance of a report: program, commit, scene, machine and date.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::stamp::Stamp;
use serde::{Deserialize, Serialize};

/// Origin of a report.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Provenance {
    /// The command line that ran.
    pub program: String,
    /// Version.
    pub version: String,
    /// The commit, if the executable was built in a git checkout that is still there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub git: Option<Git>,
    /// The scene as it was run.
    pub scene: String,
    /// File of the scene, once the run is finished.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<PathBuf>,
    /// Hashes of all that the results were computed from, once the run is finished.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stamp: Option<Stamp>,
    /// The machine.
    pub host: Host,
    /// Time at which the report was begun, UTC, ISO 8601.
    pub date: String,
}

/// The state of the checkout the executable was built in.
///
/// Read when the program runs, not when it is built: a build script would recompile everything after each
/// commit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Git {
    /// The commit that is checked out.
    pub hash: String,
    /// The executable is older than that checkout, so it may stem from an earlier commit.
    pub executable_is_older: bool,
}

/// A machine.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Host {
    /// The processor's name.
    pub cpu: String,
    /// `linux x86_64`.
    pub system: String,
    /// Physical cores, or hardware threads where the system does not tell them apart.
    pub cores: usize,
    /// Threads that computed.
    pub threads: usize,
}

impl Provenance {
    pub(super) fn new(program: &str, version: &str, scene: &str) -> Self {
        Self {
            program: program.to_owned(),
            version: version.to_owned(),
            git: Git::find(),
            scene: scene.to_owned(),
            path: None,
            stamp: None,
            host: Host::find(),
            date: date(SystemTime::now()),
        }
    }
}

impl Host {
    fn find() -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let cpuinfo = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let field = |line: &str, name: &str| {
            let (key, value) = line.split_once(':')?;
            (key.trim() == name).then(|| value.trim().to_owned())
        };
        let cpu = cpuinfo.lines().find_map(|line| field(line, "model name"));
        let mut cores: Vec<(String, String)> = Vec::new();
        let mut socket = String::new();
        for line in cpuinfo.lines() {
            if let Some(id) = field(line, "physical id") {
                socket = id;
            } else if let Some(core) = field(line, "core id") {
                let core = (socket.clone(), core);
                if !cores.contains(&core) {
                    cores.push(core);
                }
            }
        }
        Self {
            cpu: cpu.unwrap_or_else(|| "unknown".into()),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            cores: if cores.is_empty() { threads } else { cores.len() },
            threads,
        }
    }
}

impl Git {
    fn find() -> Option<Self> {
        // crates/polycore in our own checkout; a copy in cargo's registry has no .git that near
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2)?;
        let (hash, head) = head(root)?;
        let changed = |path: &Path| fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
        let built = std::env::current_exe().ok().and_then(|executable| changed(&executable));
        let executable_is_older = built.zip(changed(&head)).is_none_or(|(built, head)| built < head);
        Some(Self { hash, executable_is_older })
    }
}

/// Returns the commit checked out in `root`, and the file whose modification tells when it was.
fn head(root: &Path) -> Option<(String, PathBuf)> {
    let mut directory = root.join(".git");
    if directory.is_file() {
        // a worktree
        let pointer = fs::read_to_string(&directory).ok()?;
        directory = root.join(pointer.strip_prefix("gitdir:")?.trim());
    }
    let common = match fs::read_to_string(directory.join("commondir")) {
        Ok(relative) => directory.join(relative.trim()),
        Err(_) => directory.clone(),
    };
    let log = directory.join("logs/HEAD");
    let text = fs::read_to_string(directory.join("HEAD")).ok()?;
    let hash = match text.trim().strip_prefix("ref: ") {
        None => text.trim().to_owned(),
        Some(name) => match fs::read_to_string(common.join(name)) {
            Ok(hash) => hash.trim().to_owned(),
            Err(_) => {
                let packed = fs::read_to_string(common.join("packed-refs")).ok()?;
                packed
                    .lines()
                    .find_map(|line| line.strip_suffix(name)?.strip_suffix(' ').map(str::to_owned))?
            }
        },
    };
    let valid = (hash.len() == 40 || hash.len() == 64) && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
    valid.then_some((hash, if log.is_file() { log } else { directory.join("HEAD") }))
}

/// ISO 8601 in UTC; civil date from days after H. Hinnant, "chrono-compatible low-level date algorithms"
/// (2013).
fn date(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (days, second) = (seconds / 86400, seconds % 86400);
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    /// Dates computed with GNU date.
    #[test]
    fn dates() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (1_709_210_096, "2024-02-29T12:34:56Z"),
            (4_107_542_399, "2100-02-28T23:59:59Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(date(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
    }

    #[test]
    fn commits_in_all_layouts() {
        let directory = tempfile::tempdir().unwrap();
        let root = directory.path();
        let hash = "0123456789012345678901234567890123456789";
        let write = |name: &str, text: &str| {
            let path = root.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        assert_eq!(head(root), None);
        write(".git/HEAD", "ref: refs/heads/main\n");
        assert_eq!(head(root), None);
        write(".git/packed-refs", &format!("# pack-refs\n{hash} refs/heads/main\n"));
        assert_eq!(head(root).unwrap().0, hash);
        let other = hash.replace('0', "f");
        write(".git/refs/heads/main", &format!("{other}\n"));
        assert_eq!(head(root).unwrap().0, other);
        write(".git/HEAD", hash);
        assert_eq!(head(root).unwrap().0, hash);
        write(".git/HEAD", "garbage");
        assert_eq!(head(root), None);
        write("tree/.git", "gitdir: ../.git/worktrees/tree\n");
        write(".git/worktrees/tree/HEAD", "ref: refs/heads/main");
        write(".git/worktrees/tree/commondir", "../..\n");
        assert_eq!(head(&root.join("tree")).unwrap().0, other);
    }

    #[test]
    fn this_host() {
        let host = Host::find();
        assert!(host.cores >= 1 && host.threads >= 1 && !host.cpu.is_empty());
    }
}
