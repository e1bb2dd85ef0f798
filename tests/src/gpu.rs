//! A few devices a process, one test at a time on each. Enters: nothing. Leaves: a `Session` that, at its end, fails the
//! test when the validation layer has said anything.

use std::cell::Cell;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use caustica_gpu::{Device, DeviceOptions, Frames, Instance, InstanceOptions, Requirements};

/// A device with an instance of its own, so that messages belong to one test.
struct Lent {
    instance: Arc<Instance>,
    device: Arc<Device>,
}

/// The devices of this process: a driver on the CPU compiles shaders on one core.
struct Pool {
    free: Vec<Lent>,
    left_to_make: usize,
}

static POOL: Mutex<Pool> = Mutex::new(Pool { free: Vec::new(), left_to_make: 2 });
static RETURNED: Condvar = Condvar::new();

thread_local! {
    static HELD: Cell<bool> = const { Cell::new(false) };
}

/// The device, for the length of one test.
pub struct Session {
    /// The instance, whose messages are watched.
    pub instance: Arc<Instance>,
    /// The device.
    pub device: Arc<Device>,
    /// Frames in flight, of this session alone.
    pub frames: Frames,
    /// Last, so that all else of the test is gone when the next one begins.
    _turn: Turn,
}

/// An instance with the validation layer and synchronisation validation.
///
/// # Panics
/// Without a Vulkan loader or without the layer: a test that validates nothing must not pass.
pub fn validated_instance() -> Arc<Instance> {
    let instance =
        Instance::new(InstanceOptions { validation: true, display: None }).expect("Vulkan does not start");
    assert!(
        instance.validation_is_on(),
        "the validation layer is missing: install vulkan-validationlayers (scripts/setup.sh --test does)"
    );
    instance
}

/// What device the tests ask for: `CAUSTICA_TEST_DEVICE` (name or index), else the best.
pub fn device_options() -> DeviceOptions {
    let device = std::env::var("CAUSTICA_TEST_DEVICE").ok();
    DeviceOptions { requirements: Requirements { device, present: false }, memory_limit_bytes: None }
}

/// Waits for its turn and gives the device to a test.
///
/// # Panics
/// Without a device that can run Caustica, without the validation layer, or when this test holds a session already.
pub fn session() -> Session {
    assert!(!HELD.replace(true), "this test holds the device already: drop the first session");
    begin(Turn::take())
}

/// A device of the test's own that gives out no more than this.
///
/// # Panics
/// As [`session`].
pub fn session_within(memory_limit_bytes: u64) -> Session {
    assert!(!HELD.replace(true), "this test holds the device already: drop the first session");
    let instance = validated_instance();
    let options = DeviceOptions { memory_limit_bytes: Some(memory_limit_bytes), ..device_options() };
    let device = Device::new(&instance, &options).expect("no device can run the tests");
    begin(Turn { lent: Lent { instance, device }, of_pool: false })
}

fn begin(turn: Turn) -> Session {
    let Lent { instance, device } = &turn.lent;
    let (instance, device) = (Arc::clone(instance), Arc::clone(device));
    // What an earlier test has said was that test's failure.
    drop(instance.take_messages());
    let frames = Frames::new(&device).expect("no command buffers");
    Session { instance, device, frames, _turn: turn }
}

/// A device, out of the pool until it is dropped, or of a test's own.
struct Turn {
    lent: Lent,
    of_pool: bool,
}

impl Turn {
    fn take() -> Self {
        let mut pool = pool();
        loop {
            if let Some(lent) = pool.free.pop() {
                return Self { lent, of_pool: true };
            }
            if pool.left_to_make > 0 {
                let instance = validated_instance();
                let device = Device::new(&instance, &device_options()).expect("no device can run the tests");
                eprintln!("device: {} ({})", device.name(), device.driver());
                pool.left_to_make -= 1;
                return Self { lent: Lent { instance, device }, of_pool: true };
            }
            pool = RETURNED.wait(pool).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        if !self.of_pool {
            return;
        }
        let Lent { instance, device } = &self.lent;
        let lent = Lent { instance: Arc::clone(instance), device: Arc::clone(device) };
        pool().free.push(lent);
        RETURNED.notify_one();
    }
}

fn pool() -> MutexGuard<'static, Pool> {
    POOL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Fails when the validation layer has said anything.
///
/// # Panics
/// With the messages.
pub fn assert_silent(instance: &Instance) {
    let messages = instance.take_messages();
    let text: Vec<String> =
        messages.iter().map(|message| format!("{}: {}", message.id, message.text)).collect();
    assert!(text.is_empty(), "{} validation messages:\n{}", text.len(), text.join("\n"));
}

impl Drop for Session {
    fn drop(&mut self) {
        HELD.set(false);
        if let Err(error) = self.frames.finish() {
            eprintln!("the device did not finish: {error}");
        }
        if std::thread::panicking() {
            for message in self.instance.take_messages() {
                eprintln!("validation: {}: {}", message.id, message.text);
            }
        } else {
            assert_silent(&self.instance);
        }
    }
}
