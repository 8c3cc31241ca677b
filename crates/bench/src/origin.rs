//! Where figures come from: commit, processor, cores. They stand beside every result.

use std::path::Path;

use twinray_validate::commit;

/// What was measured, and on what.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    /// Short hash, and whether sources were changed since.
    pub commit: String,
    /// Model name.
    pub processor: String,
    /// Threads that the machine runs at once.
    pub cores: usize,
}

impl Origin {
    /// Of the checkout at `root` and this machine.
    pub fn of(root: &Path) -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let processor = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| model(&text));
        let processor = processor.unwrap_or_else(|| std::env::consts::ARCH.to_owned());
        Self { commit: commit::hash(root), processor, cores }
    }
}

/// The first model name of `/proc/cpuinfo`, with the widest vectors, which tell processors of one name apart.
fn model(cpuinfo: &str) -> Option<String> {
    let value = |key: &str| {
        let line = cpuinfo.lines().find(|l| l.split(':').next().is_some_and(|k| k.trim() == key))?;
        line.split_once(':').map(|(_, value)| value.trim().to_owned())
    };
    let flags = value("flags").unwrap_or_default();
    let has = |flag: &str| flags.split(' ').any(|f| f == flag);
    let vectors = if has("avx512f") {
        ", AVX-512"
    } else if has("avx2") {
        ", AVX2"
    } else {
        ""
    };
    let numbers = match (value("cpu family"), value("model")) {
        (Some(family), Some(model)) => format!(" (family {family}, model {model}{vectors})"),
        _ => String::new(),
    };
    value("model name").map(|name| name + &numbers)
}

/// A line of `/proc/self/status`, bytes; `None` where there is no such file.
pub fn status_bytes(key: &str) -> Option<f64> {
    status(&std::fs::read_to_string("/proc/self/status").ok()?, key)
}

fn status(text: &str, key: &str) -> Option<f64> {
    let line = text.lines().find_map(|l| l.strip_prefix(key)?.strip_prefix(':'))?;
    line.trim().strip_suffix(" kB")?.trim().parse::<f64>().ok().map(|kilobytes| 1024.0 * kilobytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_kernel_says_is_read() {
        let text = "processor\t: 0\nmodel name\t: Some 9\ncpu family\t: 25\nmodel\t\t: 17\nflags\t\t: sse avx2\n";
        assert_eq!(model(text).unwrap(), "Some 9 (family 25, model 17, AVX2)");
        assert_eq!(model("nothing"), None);
        assert_eq!(status("VmPeak:\t  9 kB\nVmHWM:\t   12 kB\n", "VmHWM"), Some(12.0 * 1024.0));
        assert_eq!(status("VmHWM2:\t   12 kB\n", "VmHWM"), None);
    }
}
