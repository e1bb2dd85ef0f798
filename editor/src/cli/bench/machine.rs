//! Where and when figures were taken. Enters: what the system tells. Leaves: plain values, null where it tells nothing.

use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};

/// Processor, threads, memory, system.
pub(super) fn describe() -> Value {
    json!({
        "processor": field("/proc/cpuinfo", "model name"),
        "threads": std::thread::available_parallelism().map(std::num::NonZero::get).ok(),
        "memory_mib": field("/proc/meminfo", "MemTotal").and_then(|text| kib_of(&text)).map(|kib| kib >> 10),
        "system": format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
    })
}

/// Memory that this process holds now, bytes.
pub(super) fn resident_bytes() -> Option<u64> {
    field("/proc/self/status", "VmRSS").and_then(|text| kib_of(&text)).map(|kib| kib << 10)
}

/// Today by the clock of the system, UTC, as 2026-11-25.
pub(super) fn today() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let (year, month, day) = date_of((since.as_secs() / 86_400) as i64);
    format!("{year}-{month:02}-{day:02}")
}

/// The value of the first line `name: value` of a file.
fn field(file: &str, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let mut values = text.lines().filter_map(|line| line.split_once(':'));
    values.find(|(key, _)| key.trim() == name).map(|(_, value)| value.trim().to_owned())
}

/// The number of a value such as `1234 kB`.
fn kib_of(text: &str) -> Option<u64> {
    text.split_whitespace().next()?.parse().ok()
}

/// Date of a day counted from 1970-01-01 (Hinnant, "chrono-compatible low-level date algorithms", `civil_from_days`).
fn date_of(day: i64) -> (i64, i64, i64) {
    // Years begin in March, so that the leap day is the last of its year.
    let day = day + 719_468;
    let era = day.div_euclid(146_097);
    let of_era = day.rem_euclid(146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * of_year + 2) / 153;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    (year, month, of_year - (153 * month_from_march + 2) / 5 + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_become_dates() {
        let dates =
            [(0, (1970, 1, 1)), (11_016, (2000, 2, 29)), (11_017, (2000, 3, 1)), (20_782, (2026, 11, 25))];
        for (day, date) in dates {
            assert_eq!(date_of(day), date);
        }
    }

    #[test]
    fn values_of_the_system_are_read() {
        assert_eq!(kib_of("1234 kB"), Some(1234));
        assert_eq!(field("/no/such/file", "x"), None);
    }
}
