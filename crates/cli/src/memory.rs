//! How much memory this process has taken, and how much there is: Linux tells, elsewhere nothing is known.
//!
//! Files that are not there, or say something else than expected, are no error.

use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// Resident bytes of this process: now, and at most so far.
pub fn of_process() -> Option<[u64; 2]> {
    let status = read_to_string("/proc/self/status").ok()?;
    Some([field(&status, "VmRSS")?, field(&status, "VmHWM")?])
}

/// Bytes that may still be taken: what the system has, or less where this process's group of processes has a limit.
pub fn available() -> Option<u64> {
    let system = field(&read_to_string("/proc/meminfo").ok()?, "MemAvailable")?;
    let groups = read_to_string("/proc/self/cgroup").unwrap_or_default();
    let left = group_folders(&groups).iter().filter_map(|folder| left_in(folder)).min();
    Some(left.map_or(system, |left| left.min(system)))
}

/// The number of a line such as `VmHWM:  1234 kB`, in bytes.
fn field(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

/// Folders of the control groups that `/proc/self/cgroup` names and of all above them, of version 2 and 1.
fn group_folders(groups: &str) -> Vec<PathBuf> {
    let mut folders = Vec::new();
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else { continue };
        let root = match controllers {
            "" => Path::new("/sys/fs/cgroup"),
            list if list.split(',').any(|c| c == "memory") => Path::new("/sys/fs/cgroup/memory"),
            _ => continue,
        };
        let below = Path::new(path.trim_start_matches('/'));
        folders.extend(below.ancestors().map(|path| root.join(path)));
    }
    folders
}

/// What is left of the limit of the group at `folder`, if it has one.
fn left_in(folder: &Path) -> Option<u64> {
    let number = |name: &str| read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
    let limit = number("memory.max").or_else(|| number("memory.limit_in_bytes"))?;
    let used = number("memory.current").or_else(|| number("memory.usage_in_bytes"))?;
    // Pages of files that were read are given back when memory is short.
    let cached = read_to_string(folder.join("memory.stat"))
        .ok()
        .and_then(|stat| stat.lines().find_map(|line| line.strip_prefix("inactive_file ")?.trim().parse::<u64>().ok()));
    Some(limit.saturating_sub(used.saturating_sub(cached.unwrap_or(0))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_found_by_their_whole_name() {
        let status = "Name:\ttwinray\nVmHWMx:\t1 kB\nVmHWM:\t    1234 kB\nVmRSS:\t many kB\n";
        assert_eq!(field(status, "VmHWM"), Some(1234 * 1024));
        assert_eq!([field(status, "VmRSS"), field(status, "VmPeak"), field("", "VmRSS")], [None; 3]);
    }

    #[test]
    fn groups_of_both_versions_are_found_with_those_above() {
        let folders = group_folders("12:cpu,memory:/a/b\n3:pids:/c\n0::/user.slice/x\nodd\n");
        let expected = ["memory/a/b", "memory/a", "memory", "user.slice/x", "user.slice", ""]
            .map(|p| Path::new("/sys/fs/cgroup").join(p));
        assert_eq!(folders, expected);
    }

    #[test]
    fn what_is_left_of_a_limit_counts_cached_files_as_free() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(left_in(folder.path()), None);
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("memory.max", "max\n");
        write("memory.current", "600\n");
        assert_eq!(left_in(folder.path()), None);
        write("memory.max", "1000\n");
        assert_eq!(left_in(folder.path()), Some(400));
        write("memory.stat", "anon 1\ninactive_file 150\n");
        assert_eq!(left_in(folder.path()), Some(550));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn linux_tells() {
        let [now, most] = of_process().unwrap();
        assert!(now > 0 && now <= most + (1 << 20), "{now} {most}");
        assert!(available().unwrap() > 0);
    }
}
