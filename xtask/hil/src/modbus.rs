//! A Modbus RTU master, as small as the checks need it: one request, one answer.

use std::time::{Duration, Instant};

use serial2::Parity;

use crate::patience;
use crate::port::Port;

/// As delivered: 19200 bit/s, address 1.
const BAUD: u32 = 19_200;
const ADDRESS: u8 = 1;
/// What ends an answer. The standard's 3.5 characters are 2 ms, which a USB adapter cannot keep.
const SILENCE: Duration = Duration::from_millis(150);
/// How long the absence of an answer takes to show.
pub const NO_ANSWER: Duration = Duration::from_millis(1_500);

/// After how long a request is repeated, where some are lost.
const REPEATED: Duration = Duration::from_secs(2);

/// An open port.
pub struct Master {
    port: Port,
    /// A request without an answer is repeated.
    repeats: bool,
    /// The longest time from a request to the end of its answer, this computer and its adapter included.
    pub longest: Duration,
}

impl Master {
    /// Opens it, as the image is delivered: even parity.
    ///
    /// # Errors
    /// The port's.
    pub fn open(path: &str) -> Result<Master, String> {
        let port = Port::open(path, BAUD, Parity::Even)?;
        Ok(Master { port, repeats: false, longest: Duration::ZERO })
    }

    /// The same master, which repeats a request that has no answer, as masters do.
    pub fn repeating(self) -> Master {
        Master { repeats: true, ..self }
    }

    /// Reads registers with function 3.
    ///
    /// # Errors
    /// No answer, a wrong one, or an exception.
    pub fn read(&mut self, address: u16, count: u16) -> Result<Vec<u16>, String> {
        let [a, b] = address.to_be_bytes();
        let [c, d] = count.to_be_bytes();
        let answer = self.exchange(&[3, a, b, c, d], patience::ANSWER)?;
        match answer.as_slice() {
            [3, bytes, data @ ..]
                if usize::from(*bytes) == data.len() && data.len() == 2 * usize::from(count) =>
            {
                Ok(data.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect())
            }
            other => Err(format!("registers {address:#06x}: answer {other:02x?}")),
        }
    }

    /// Sends a request without its frame and returns the answer without its own.
    ///
    /// # Errors
    /// No answer within that time, or one that is no frame.
    pub fn exchange(&mut self, request: &[u8], longest: Duration) -> Result<Vec<u8>, String> {
        let mut frame = vec![ADDRESS];
        frame.extend_from_slice(request);
        frame.extend_from_slice(&crc(&frame).to_le_bytes());
        let begun = Instant::now();
        let answer = loop {
            let answer = self.raw(&frame, if self.repeats { REPEATED.min(longest) } else { longest })?;
            if !answer.is_empty() || begun.elapsed() >= longest {
                break answer;
            }
        };
        match answer.as_slice() {
            [] => Err(format!("no answer to {request:02x?}")),
            [ADDRESS, body @ .., _, _] if crc(&answer) == 0 && !body.is_empty() => Ok(body.to_vec()),
            other => Err(format!("answer {other:02x?} to {request:02x?} is no frame from address {ADDRESS}")),
        }
    }

    /// Sends bytes as they are; whatever comes back before a silence, or nothing within that time.
    ///
    /// # Errors
    /// The port's.
    pub fn raw(&mut self, bytes: &[u8], longest: Duration) -> Result<Vec<u8>, String> {
        // What is left of something else.
        while !self.port.receive(Duration::from_millis(5))?.is_empty() {}
        let begun = Instant::now();
        self.port.send(bytes)?;
        let mut answer = Vec::new();
        loop {
            let silence = if answer.is_empty() { longest.saturating_sub(begun.elapsed()) } else { SILENCE };
            let waited = Instant::now();
            let piece = self.port.receive(silence)?;
            if piece.is_empty() && (waited.elapsed() >= silence || begun.elapsed() >= longest) {
                return Ok(answer);
            }
            if !piece.is_empty() {
                self.longest = self.longest.max(begun.elapsed());
            }
            answer.extend(piece);
        }
    }
}

/// Zero over a frame with its checksum (MODBUS over Serial Line V1.02, section 6.2.2).
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, &byte| {
        (0..8).fold(crc ^ u16::from(byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xA001 } else { crc >> 1 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_that_of_the_standard() {
        // Section 6.2.2 of the standard: 02 07 has the checksum 41 12.
        assert_eq!(crc(&[0x02, 0x07]).to_le_bytes(), [0x41, 0x12]);
        assert_eq!(crc(&[0x02, 0x07, 0x41, 0x12]), 0);
    }
}
