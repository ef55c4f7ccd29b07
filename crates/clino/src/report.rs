//! What goes to standard output: JSON, one object per line, and encoded frames.

use std::io::{self, Write};

use serde::Serialize;

use crate::bad::Bad;
use crate::hex;
use crate::outcome::{Failure, Verdict};

/// Writes what a frame means, or what is wrong with it.
///
/// # Errors
/// The output failed.
pub fn line(output: &mut impl Write, result: Result<impl Serialize, Bad>) -> io::Result<Verdict> {
    let verdict = match &result {
        Ok(_) => Verdict::Good,
        Err(_) => Verdict::Bad,
    };
    match result {
        Ok(meaning) => serde_json::to_writer(&mut *output, &meaning)?,
        Err(bad) => serde_json::to_writer(&mut *output, &bad)?,
    }
    output.write_all(b"\n")?;
    Ok(verdict)
}

/// Writes a frame that was encoded.
///
/// # Errors
/// The output failed.
pub fn frame(bytes: &[u8]) -> Result<Verdict, Failure> {
    writeln!(io::stdout().lock(), "{}", hex::show(bytes))?;
    Ok(Verdict::Good)
}
