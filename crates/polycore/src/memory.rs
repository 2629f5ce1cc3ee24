//! Available memory; formatting of byte counts.
//!
//! A program states the memory of a scene before it allocates any: `check` and `--explain` print a line of
//! [`needs`], and a scene that needs more than [`available`] is refused.

use std::path::Path;

/// Bytes of a GiB.
pub const GIB: f64 = (1_u64 << 30) as f64;

/// Bytes that this program may still allocate: the least of the machine's free memory (`MemAvailable` of
/// Linux), the limits of the process (`ulimit -v` and `ulimit -d`), and those of each control group around it
/// (versions 1 and 2); 16 GiB if no limit is known.
pub fn available() -> f64 {
    available_in(Path::new("/"))
}

/// Computes [`available`] with `/proc` and `/sys` below `root`.
fn available_in(root: &Path) -> f64 {
    let read = |path: &str| std::fs::read_to_string(root.join(path)).unwrap_or_default();
    let machine = entry(&read("proc/meminfo"), "MemAvailable:").map(|kib| kib * 1024.0);
    let (limits, status) = (read("proc/self/limits"), read("proc/self/status"));
    let left = |limit: &str, taken: &str| {
        let taken = entry(&status, taken).map_or(0.0, |kib| kib * 1024.0);
        entry(&limits, limit).map(|bytes| (bytes - taken).max(0.0))
    };
    let process = [left("Max address space", "VmSize:"), left("Max data size", "VmData:")];
    let groups = read("proc/self/cgroup");
    let groups = groups.lines().filter_map(|line| {
        let mut parts = line.splitn(3, ':');
        let (_, controllers, path) = (parts.next()?, parts.next()?, parts.next()?);
        let mounts: &[(&str, [&str; 3])] = match controllers {
            "" => &[("sys/fs/cgroup", VERSION_2), ("sys/fs/cgroup/unified", VERSION_2)],
            names if names.split(',').any(|name| name == "memory") => &[("sys/fs/cgroup/memory", VERSION_1)],
            _ => &[],
        };
        let left = mounts.iter().filter_map(|(mount, files)| in_group(&root.join(mount), path, files));
        left.reduce(f64::min)
    });
    machine
        .into_iter()
        .chain(process.into_iter().flatten())
        .chain(groups)
        .reduce(f64::min)
        .unwrap_or(16.0 * GIB)
}

/// Files of a control group: its limit, its usage, and the entry of `memory.stat` that can be reclaimed.
const VERSION_1: [&str; 3] = ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"];
const VERSION_2: [&str; 3] = ["memory.max", "memory.current", "inactive_file"];

/// Free memory within the limits of a control group and its ancestors, bytes; `None` without a limit. If the
/// path belongs to another name space, as in a container, the groups that exist count.
fn in_group(mount: &Path, path: &str, [limit, taken, cache]: &[&str; 3]) -> Option<f64> {
    let folder = mount.join(path.trim_start_matches('/'));
    let above = folder.ancestors().take_while(|folder| folder.starts_with(mount));
    let left = above.filter_map(|folder| {
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap_or_default();
        let limit: f64 = read(limit).trim().parse().ok()?;
        let taken: f64 = read(taken).trim().parse().unwrap_or(0.0);
        let cache = entry(&read("memory.stat"), cache).unwrap_or(0.0);
        Some((limit - (taken - cache).max(0.0)).max(0.0))
    });
    left.reduce(f64::min)
}

/// First number after a name at the start of a line.
fn entry(text: &str, name: &str) -> Option<f64> {
    let rest = text
        .lines()
        .find_map(|line| line.strip_prefix(name).filter(|rest| rest.starts_with(char::is_whitespace)))?;
    rest.split_whitespace().next()?.parse().ok()
}

/// Line that states an estimate in bytes: `at most about 120 MB of memory`.
pub fn needs(bytes: f64) -> String {
    format!("at most about {:.0} MB of memory", bytes / 1e6)
}

/// Formats an amount for a message: `1.5 GiB`.
pub fn gib(bytes: f64) -> String {
    format!("{:.1} GiB", bytes / GIB)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn amounts_as_they_are_told() {
        assert_eq!(needs(1.2e8), "at most about 120 MB of memory");
        assert_eq!(gib(1.5 * GIB), "1.5 GiB");
        assert!(available() > 1e6 && available().is_finite());
    }

    /// Root folder with files of these texts.
    fn root(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        root
    }

    const MACHINE: (&str, &str) = ("proc/meminfo", "MemTotal: 9000 kB\nMemAvailable:    8000 kB\n");

    #[test]
    fn the_least_of_machine_and_process() {
        let of = |files: &[(&str, &str)]| available_in(root(files).path());
        assert_eq!(of(&[]), 16.0 * GIB);
        assert_eq!(of(&[MACHINE]), 8000.0 * 1024.0);
        let limits = |address: &str, data: &str| {
            format!(
                "Limit                     Soft Limit           Hard Limit           Units\n\
                 Max data size             {data}            unlimited            bytes\n\
                 Max address space         {address}            unlimited            bytes\n"
            )
        };
        let status = ("proc/self/status", "VmPeak:\t 3000 kB\nVmSize:\t 1000 kB\nVmData:\t 500 kB\n");
        let with = |text: &str| of(&[MACHINE, ("proc/self/limits", text), status]);
        assert_eq!(with(&limits("unlimited", "unlimited")), 8000.0 * 1024.0);
        assert_eq!(with(&limits("4096000", "unlimited")), 3000.0 * 1024.0);
        assert_eq!(with(&limits("4096000", "1024000")), 500.0 * 1024.0);
        assert_eq!(with(&limits("1000", "unlimited")), 0.0);
    }

    #[test]
    fn control_groups_of_both_versions() {
        let of = |files: &[(&str, &str)]| available_in(root(&[&[MACHINE], files].concat()).path());
        let two = ("proc/self/cgroup", "0::/user/job\n");
        let inner = [
            two,
            ("sys/fs/cgroup/user/job/memory.max", "max\n"),
            ("sys/fs/cgroup/user/job/memory.current", "100000\n"),
            ("sys/fs/cgroup/user/memory.max", "5000000\n"),
            ("sys/fs/cgroup/user/memory.current", "2000000\n"),
        ];
        assert_eq!(of(&inner), 3_000_000.0);
        // cached file pages can be reclaimed
        let cached = ("sys/fs/cgroup/user/memory.stat", "anon 1\ninactive_file 500000\nactive_file 7\n");
        assert_eq!(of(&[&inner[..], &[cached]].concat()), 3_500_000.0);
        let own = [("sys/fs/cgroup/user/job/memory.max", "300000\n")];
        assert_eq!(of(&[&inner[..], &own].concat()), 200_000.0);
        let one = [
            ("proc/self/cgroup", "5:cpu,cpuacct:/a\n4:memory:/docker/abc\n0::/\n"),
            ("sys/fs/cgroup/memory/memory.limit_in_bytes", "4000000\n"),
            ("sys/fs/cgroup/memory/memory.usage_in_bytes", "1000000\n"),
            ("sys/fs/cgroup/memory/memory.stat", "total_inactive_file 250000\n"),
        ];
        // the path is the host's, the files are the container's
        assert_eq!(of(&one), 3_250_000.0);
        let free = [("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n")];
        assert_eq!(of(&[&one[..], &free].concat()), 8000.0 * 1024.0);
    }
}
