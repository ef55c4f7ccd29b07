//! A master, a gateway and a checksum for the tests, none of them made of the crate's own parts.
#![allow(dead_code, reason = "every test uses its own part of it")]

pub mod board;
pub mod real;
pub mod traffic;

use clino_bus::Instant;
use clino_codec::character::{Character, LineErrors};
use clino_modbus::settings::{Parity, Settings, StopBits};
use clino_modbus::{Host, Identification, Server};
use real::Real;

pub const ADDRESS: u8 = 17;

pub const SETTINGS: Settings = Settings {
    address: ADDRESS,
    baud: 19_200,
    parity: Parity::Even,
    stop_bits: StopBits::One,
    ..Settings::DEFAULT
};

pub const IDENTIFICATION: &Identification =
    &Identification(["Vendor", "P-1", "1.2.3", "https://example.org", "Gateway", "Model"]);

/// CRC-16 as textbooks have it, most significant bit first with 0x8005: bytes and result are mirrored.
pub fn crc(bytes: &[u8]) -> u16 {
    let mut register = 0xFFFF_u16;
    for byte in bytes {
        for bit in 0..8 {
            let incoming = u16::from(byte >> bit & 1);
            let outgoing = register >> 15;
            register <<= 1;
            if incoming != outgoing {
                register ^= 0x8005;
            }
        }
    }
    register.reverse_bits()
}

/// A frame with its checksum, low byte first.
pub fn sealed(bytes: &[u8]) -> Vec<u8> {
    let crc = crc(bytes);
    [bytes, &[(crc % 256) as u8, (crc / 256) as u8]].concat()
}

/// A frame without its checksum, which has to be right.
pub fn opened(frame: &[u8]) -> &[u8] {
    let (bytes, found) = frame.split_at(frame.len() - 2);
    let crc = crc(bytes);
    assert_eq!(found, [(crc % 256) as u8, (crc / 256) as u8], "checksum of {frame:02X?}");
    bytes
}

/// A server, its gateway and its clock.
pub struct Bench<H = Real> {
    pub server: Server,
    pub host: H,
    pub now: u64,
    /// Microseconds of a character.
    pub character: u64,
    /// Microseconds of t3.5.
    pub t3_5: u64,
}

impl Bench {
    pub fn new() -> Bench {
        Bench::with(SETTINGS, 573, 2_006)
    }

    /// With the times of a character and of t3.5 as the test knows them, µs.
    pub fn with(settings: Settings, character: u64, t3_5: u64) -> Bench {
        Bench::at(Real::new(), settings, character, t3_5)
    }
}

impl<H: Host> Bench<H> {
    /// The same with another gateway.
    pub fn at(host: H, settings: Settings, character: u64, t3_5: u64) -> Bench<H> {
        let server = Server::new(settings, IDENTIFICATION, Instant::from_micros(0));
        let mut bench = Bench { server, host, now: 0, character, t3_5 };
        bench.pause(10 * t3_5);
        bench
    }

    /// Time passes without a character. Returns what the server says in it.
    pub fn pause(&mut self, micros: u64) -> Option<Vec<u8>> {
        let end = self.now + micros;
        let mut said = None;
        while let Some(at) = self.server.poll_at().filter(|at| at.as_micros() <= end) {
            self.now = self.now.max(at.as_micros());
            if let Some(answer) = self.server.poll(Instant::from_micros(self.now), &mut self.host) {
                let answer = answer.to_vec();
                self.now += self.character * answer.len() as u64;
                self.server.sent(Instant::from_micros(self.now));
                assert_eq!(said.replace(answer), None, "two answers in one pause");
            }
        }
        self.now = self.now.max(end);
        said
    }

    /// A character comes in, right after the one before.
    pub fn character(&mut self, byte: u8, errors: LineErrors) {
        self.now += self.character;
        self.server.heard(Character { byte, errors }, Instant::from_micros(self.now));
    }

    /// A silence after which whatever came is over: one that is no frame yet may go on with a character that began in
    /// t3.5, and is stamped late.
    pub fn over(&self) -> u64 {
        self.t3_5 + 2 * self.character + 50
    }

    /// Bytes as they are, then silence.
    pub fn raw(&mut self, bytes: &[u8]) -> Option<Vec<u8>> {
        for &byte in bytes {
            self.character(byte, LineErrors::NONE);
        }
        self.pause(self.over())
    }

    /// A request: function and data. Returns function and data of the answer.
    pub fn ask(&mut self, pdu: &[u8]) -> Vec<u8> {
        let request = sealed(&[&[ADDRESS], pdu].concat());
        let answer = self.raw(&request).unwrap_or_else(|| panic!("no answer to {pdu:02X?}"));
        assert!(answer.len() <= 256);
        let (&address, pdu) = opened(&answer).split_first().expect("an address");
        assert_eq!(address, ADDRESS);
        pdu.to_vec()
    }

    /// Registers, with function 3.
    pub fn read(&mut self, first: u16, quantity: u16) -> Result<Vec<u16>, u8> {
        self.read_with(3, first, quantity)
    }

    pub fn read_with(&mut self, function: u8, first: u16, quantity: u16) -> Result<Vec<u16>, u8> {
        let (f, q) = (first.to_be_bytes(), quantity.to_be_bytes());
        let answer = self.ask(&[function, f[0], f[1], q[0], q[1]]);
        if answer[0] == function | 0x80 {
            assert_eq!(answer.len(), 2);
            return Err(answer[1]);
        }
        assert_eq!(answer[..2], [function, (quantity * 2) as u8]);
        assert_eq!(answer.len(), 2 + usize::from(quantity) * 2);
        Ok(answer[2..].chunks(2).map(|pair| u16::from(pair[0]) * 256 + u16::from(pair[1])).collect())
    }

    /// Writes with function 16.
    pub fn write(&mut self, first: u16, words: &[u16]) -> Result<(), u8> {
        let answer = self.ask(&write_request(first, words));
        if answer[0] == 0x90 {
            assert_eq!(answer.len(), 2);
            return Err(answer[1]);
        }
        let (f, q) = (first.to_be_bytes(), (words.len() as u16).to_be_bytes());
        assert_eq!(answer, [16, f[0], f[1], q[0], q[1]]);
        Ok(())
    }

    /// Writes with function 6.
    pub fn write_one(&mut self, address: u16, word: u16) -> Result<(), u8> {
        let (a, w) = (address.to_be_bytes(), word.to_be_bytes());
        let request = [6, a[0], a[1], w[0], w[1]];
        let answer = self.ask(&request);
        if answer[0] == 0x86 {
            assert_eq!(answer.len(), 2);
            return Err(answer[1]);
        }
        assert_eq!(answer, request);
        Ok(())
    }
}

/// Function and data of a function 16.
pub fn write_request(first: u16, words: &[u16]) -> Vec<u8> {
    let (f, q) = (first.to_be_bytes(), (words.len() as u16).to_be_bytes());
    let mut request = vec![16, f[0], f[1], q[0], q[1], (words.len() * 2) as u8];
    request.extend(words.iter().flat_map(|word| word.to_be_bytes()));
    request
}
