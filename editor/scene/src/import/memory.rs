//! How much memory the machine has, so that pictures are refused that it cannot hold. A picture of one colour takes no bytes in
//! a file and as much memory as any other: it counts by its texels.

use std::sync::LazyLock;

/// Half of the memory of the machine, bytes: what decoded pictures may take. No end where the system does not tell.
pub(super) fn half_of_machine() -> u64 {
    static HALF: LazyLock<u64> = LazyLock::new(|| {
        let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
        total_bytes(&text).map_or(u64::MAX, |bytes| bytes / 2)
    });
    *HALF
}

fn total_bytes(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    line.trim().strip_suffix("kB")?.trim().parse().ok().map(|kib: u64| kib.saturating_mul(1024))
}

/// Why pictures that take so many bytes are refused, in words.
pub(super) fn refusal(wanted: u64, limit: u64) -> Option<String> {
    (wanted > limit).then(|| {
        let [wanted, limit] = [wanted, limit].map(|bytes| bytes >> 20);
        format!("decoded, it becomes {wanted} MiB; pictures may take {limit} MiB here, half of the memory")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_memory_of_the_machine_is_read() {
        assert_eq!(total_bytes("MemTotal:       24671984 kB\nMemFree: 1 kB"), Some(24_671_984 << 10));
        assert_eq!(total_bytes(""), None);
        assert_eq!(refusal(2 << 20, 2 << 20), None);
        assert!(
            refusal(3 << 20, 2 << 20).is_some_and(|words| words.contains("3 MiB") && words.contains("2 MiB"))
        );
    }
}
