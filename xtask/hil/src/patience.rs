//! How long to wait, by the computer's clock. Nothing is judged by it: it only ends what would not end.

use std::time::{Duration, Instant};

/// For a line of the console or an answer of the Modbus port. The virtual board on a busy computer is many times slower than
/// real time.
pub const ANSWER: Duration = Duration::from_secs(20);
/// For the image's start after flashing.
pub const START: Duration = Duration::from_secs(120);
/// For a slot to reach a state.
pub const STATE: Duration = Duration::from_secs(90);
/// Between two looks.
pub const LOOK: Duration = Duration::from_millis(100);

/// Looks until there is something; what was missing if there is not in time.
pub fn until<T>(
    longest: Duration,
    mut look: impl FnMut() -> Result<Result<T, String>, String>,
) -> Result<T, String> {
    let deadline = Instant::now() + longest;
    loop {
        match look()? {
            Ok(found) => return Ok(found),
            Err(missing) if Instant::now() > deadline => {
                return Err(format!("{missing} after {} s", longest.as_secs()));
            }
            Err(_) => std::thread::sleep(LOOK),
        }
    }
}
