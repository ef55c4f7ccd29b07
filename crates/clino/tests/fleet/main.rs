//! `clino bridge` and `clino serve`, the programs themselves: gateways that are made up here or run the shipped image, a real
//! broker, a real browser.
//!
//! What a gateway's lines say is restated from `docs/console.md`; what a broker carries is read by its own client.
#![cfg(all(feature = "fleet", target_os = "linux"))]

mod away;
mod board;
mod broker;
mod browser;
mod clock;
mod configuration;
mod disk;
mod documents;
mod gateway;
mod load;
mod messages;
mod metrics;
mod monitors;
mod page;
mod program;
mod recipes;
mod registers;
#[allow(dead_code, reason = "the tests of the simulator use the rest")]
#[path = "../sim/server.rs"]
mod server;
mod sources;
mod sparkplug;
mod wire;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a busy computer may take for what is at once on an idle one.
const PATIENCE: Duration = Duration::from_secs(30);

/// Where programs are installed: below the target directory, once.
fn programs() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
}

/// A folder of this test, empty.
fn folder(test: &str) -> PathBuf {
    let folder = programs().join("fleet").join(format!("{test}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the target directory can be written");
    folder
}

/// A variable of the environment that is not empty.
fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|value| !value.is_empty())
}

/// Whether documents and pictures are to be written anew.
fn updates() -> bool {
    variable("UPDATE").is_some()
}

/// A file of the repository.
fn repository(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name)
}

/// A port of loopback that is free now.
fn free_port() -> u16 {
    let listener = std::net::TcpListener::bind(("127.0.0.1", 0)).expect("loopback");
    listener.local_addr().expect("it is bound").port()
}

/// Looks again and again until there is something.
fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begun.elapsed() < PATIENCE, "{what}: not within {} s", PATIENCE.as_secs());
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// UTC, in milliseconds since 1970.
fn now_ms() -> i64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("after 1970");
    i64::try_from(since.as_millis()).expect("this century")
}
