//! Damaged files of every kind that is read: no panic, no hang, no runaway memory, and a reason with a place.
//!
//! A case is a number: it chooses the file, the damage and so the outcome. `make test` runs a share of them, spread over all files;
//! `make mutate` (`CAUSTICA_MUTATIONS=100000`) runs that many, and `CAUSTICA_MUTATION=17` runs case 17 alone.
//! In a binary of its own, because it counts the memory of the whole process.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod corpus;
mod json;
mod mutate;
mod numbers;
mod outcome;
mod rich;

use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use corpus::Seed;
use numbers::Numbers;
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// A case that takes longer hangs. Far above the 2 s that the importers are meant to keep, for a loaded machine.
const HANG: Duration = Duration::from_secs(10);
/// What a small file may take, bytes, and a larger one by its size.
const FREE_BYTES: usize = 256 << 20;
const TIMES_FILE: usize = 10;
/// The share of `make test`.
const SHARE: u64 = 30_000;
/// After so many faults of different words the rest tells nothing new.
const MOST_FAULTS: usize = 30;

/// What is running, for whoever waits.
type Running = Arc<Mutex<Option<(u64, String, Instant)>>>;

#[derive(Default)]
struct Tally {
    cases: u64,
    loaded: u64,
    refused: u64,
    /// By kind of file: cases, refusals, time.
    kinds: BTreeMap<&'static str, (u64, u64, Duration)>,
    longest: (Duration, u64, String),
    most_bytes: (usize, u64, String),
    /// The first of each kind, by its words without numbers and names.
    faults: BTreeMap<String, String>,
}

impl Tally {
    fn fault(&mut self, what: &str, fault: &str) {
        let reason = fault.rsplit(": ").next().unwrap_or(fault);
        let kind: String = reason.chars().filter(|c| !c.is_ascii_digit()).take(60).collect();
        self.faults.entry(kind).or_insert_with(|| format!("{what}: {fault}"));
    }
}

fn words_of(panic: &(dyn Any + Send)) -> &str {
    let owned = panic.downcast_ref::<String>().map(String::as_str);
    owned.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("without words")
}

/// Runs one case and returns whether its file was read.
fn run(case: u64, seeds: &[Seed], folder: &Path, running: &Running, tally: &mut Tally) {
    let mut numbers = Numbers::new(case);
    let seed = &seeds[numbers.below(seeds.len())];
    let folder = folder.join(&seed.name);
    let damaged = mutate::damaged(seed, seeds, &mut numbers);
    let file = folder.join(&seed.files[damaged.file].0);
    put(&file, &damaged.bytes);
    let what = format!(
        "case {case}: {} ({} in {})",
        seed.name,
        damaged.kinds.join(", "),
        seed.files[damaged.file].0
    );
    let size = damaged.bytes.len() + seed.bytes();
    MEMORY.reset_peak_usage();
    let before = PeakAlloc.current_usage();
    let start = Instant::now();
    *running.lock().unwrap() = Some((case, what.clone(), start));
    let outcome = catch_unwind(AssertUnwindSafe(|| outcome::of(seed, &folder)));
    let took = start.elapsed();
    *running.lock().unwrap() = None;
    let bytes = PeakAlloc.peak_usage().saturating_sub(before);
    put(&file, &seed.files[damaged.file].1);
    tally.cases += 1;
    let kind = tally.kinds.entry(seed.kind.name()).or_default();
    kind.0 += 1;
    kind.2 += took;
    match outcome {
        Ok(Ok(true)) => tally.loaded += 1,
        Ok(Ok(false)) => {
            tally.refused += 1;
            kind.1 += 1;
        }
        Ok(Err(fault)) => tally.fault(&what, &fault),
        Err(panic) => tally.fault(&what, &format!("panicked: {}", words_of(&*panic))),
    }
    if bytes > FREE_BYTES.max(TIMES_FILE * size) {
        tally.fault(&what, &format!("took {} MiB for {size} bytes", bytes >> 20));
    }
    if took > tally.longest.0 {
        tally.longest = (took, case, what.clone());
    }
    if bytes > tally.most_bytes.0 {
        tally.most_bytes = (bytes, case, what);
    }
}

/// A new file each time: ext4 waits for the disk where an old one is cut short and written again.
fn put(file: &Path, bytes: &[u8]) {
    std::fs::remove_file(file).unwrap();
    std::fs::write(file, bytes).unwrap();
}

fn run_all(cases: impl Iterator<Item = u64>, running: &Running) -> Tally {
    let folder = tempfile::tempdir().unwrap();
    let seeds = corpus::seeds();
    for seed in &seeds {
        seed.write(&folder.path().join(&seed.name));
    }
    let mut tally = Tally::default();
    for case in cases {
        run(case, &seeds, folder.path(), running, &mut tally);
        if tally.faults.len() >= MOST_FAULTS {
            break;
        }
    }
    tally
}

fn number_of(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

#[test]
fn damaged_files_are_refused_in_words() {
    let running = Running::default();
    let worker = {
        let running = Arc::clone(&running);
        std::thread::spawn(move || match number_of("CAUSTICA_MUTATION") {
            Some(case) => run_all(case..case + 1, &running),
            None => run_all(0..number_of("CAUSTICA_MUTATIONS").unwrap_or(SHARE), &running),
        })
    };
    while !worker.is_finished() {
        std::thread::sleep(Duration::from_millis(20));
        let hanging = running.lock().unwrap().clone().filter(|(_, _, start)| start.elapsed() > HANG);
        assert!(hanging.is_none(), "hangs: {hanging:?}");
    }
    let tally = worker.join().unwrap();
    let Tally { cases, loaded, refused, kinds, longest, most_bytes, faults } = tally;
    println!("{cases} cases: {loaded} loaded, {refused} refused, {} kinds of faults", faults.len());
    for (kind, (cases, refused, time)) in kinds {
        let mean_ms = time.as_secs_f64() * 1e3 / cases as f64;
        println!("  {kind}: {cases} cases, {refused} refused, {mean_ms:.2} ms a case");
    }
    println!("longest: {:.0} ms, {}", longest.0.as_secs_f64() * 1e3, longest.2);
    println!("most memory: {:.1} MiB, {}", most_bytes.0 as f64 / f64::from(1 << 20), most_bytes.2);
    let list: Vec<String> = faults.into_values().collect();
    assert!(list.is_empty(), "{} kinds of faults:\n{}", list.len(), list.join("\n"));
    if cases >= SHARE {
        assert!(
            loaded > cases / 20 && refused > cases / 20,
            "the damage is too weak or too strong to tell anything"
        );
    }
}

/// Otherwise the damage would tell nothing.
#[test]
fn what_is_damaged_was_sound() {
    let folder = tempfile::tempdir().unwrap();
    for seed in corpus::seeds() {
        let folder = folder.path().join(&seed.name);
        seed.write(&folder);
        let read = outcome::of(&seed, &folder);
        assert!(read == Ok(true) || (read == Ok(false) && !seed.own), "{}: {read:?}", seed.name);
    }
}
