//! What goes to standard output: JSON, one object per line, and encoded frames.

use std::io::{self, Write};

use serde::Serialize;

use crate::bad::Bad;
use crate::hex;
use crate::outcome::{DecodeVerdict, Failure};

/// Writes what a frame means, or what is wrong with it.
///
/// # Errors
/// The output failed.
pub fn line(output: &mut impl Write, result: Result<impl Serialize, Bad>) -> io::Result<DecodeVerdict> {
    let verdict = match &result {
        Ok(_) => DecodeVerdict::Good,
        Err(_) => DecodeVerdict::Bad,
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
pub fn frame(bytes: &[u8]) -> Result<DecodeVerdict, Failure> {
    writeln!(io::stdout().lock(), "{}", hex::show(bytes))?;
    Ok(DecodeVerdict::Good)
}
