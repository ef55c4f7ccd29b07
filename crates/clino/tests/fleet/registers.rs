//! A gateway's Modbus port that is made up here: registers as `docs/modbus.md` has them, served over Modbus/TCP, over RTU in
//! TCP, or over RTU on a pseudo-terminal. It answers function 3 alone.

use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use clino_pty::Terminal;

/// Registers of the map that are read.
const REGISTERS: usize = 0x1000;
/// No angle, no age.
const NO_ANGLE: [u16; 2] = [0x8000, 0];
const NO_AGE: u16 = 0xFFFF;
/// Codes of `docs/modbus.md`, *Status of a slot* and *kinds*.
const OK: u16 = 1;
const DISABLED: u16 = 13;
const NO_ANSWER: u16 = 3;
const KIND_T7: u16 = 1;

/// How its bytes are framed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Framing {
    /// Modbus/TCP: a header of seven bytes before each message, no checksum.
    Tcp,
    /// Modbus RTU: address before and CRC behind each message.
    Rtu,
}

/// Where it is.
enum Place {
    Network { port: u16, streams: Arc<Mutex<Vec<TcpStream>>> },
    Terminal { path: String },
}

/// A gateway with a Modbus port.
pub struct Registers {
    place: Place,
    registers: Arc<Mutex<Vec<u16>>>,
    is_over: Arc<AtomicBool>,
}

impl Registers {
    /// One at a free port of loopback.
    pub fn in_network(framing: Framing) -> Registers {
        Registers::at(framing, 0)
    }

    /// One at this port of loopback.
    pub fn at(framing: Framing, port: u16) -> Registers {
        let listener = crate::until("the port of a gateway", || TcpListener::bind(("127.0.0.1", port)).ok());
        let port = listener.local_addr().expect("it is bound").port();
        let streams: Arc<Mutex<Vec<TcpStream>>> = Arc::default();
        let (registers, is_over) = (Arc::new(Mutex::new(empty())), Arc::new(AtomicBool::new(false)));
        let (known, served, over) = (streams.clone(), registers.clone(), is_over.clone());
        thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                if over.load(Ordering::Relaxed) {
                    return;
                }
                known.lock().expect("no panic").push(stream.try_clone().expect("a stream"));
                let registers = served.clone();
                thread::spawn(move || serve(framing, stream, &registers));
            }
        });
        Registers { place: Place::Network { port, streams }, registers, is_over }
    }

    /// One on a pseudo-terminal, as delivered: 19200 bit/s.
    pub fn on_terminal() -> Registers {
        let mut terminal = Terminal::open(19_200).expect("a pseudo-terminal");
        let path = terminal.path().to_owned();
        let (registers, is_over) = (Arc::new(Mutex::new(empty())), Arc::new(AtomicBool::new(false)));
        let (served, over) = (registers.clone(), is_over.clone());
        thread::spawn(move || {
            let mut received = Vec::new();
            while !over.load(Ordering::Relaxed) {
                let mut buffer = [0; 256];
                received.extend_from_slice(terminal.read(&mut buffer).expect("a terminal"));
                match answer(Framing::Rtu, &mut received, &served) {
                    Some(answer) => terminal.deliver(&answer).expect("a terminal"),
                    None => thread::sleep(Duration::from_millis(2)),
                }
            }
        });
        Registers { place: Place::Terminal { path }, registers, is_over }
    }

    /// Its place in a configuration.
    pub fn endpoint(&self, framing: Framing) -> String {
        match &self.place {
            Place::Network { port, .. } if framing == Framing::Tcp => format!("tcp://127.0.0.1:{port}"),
            Place::Network { port, .. } => format!("rtu+tcp://127.0.0.1:{port}"),
            Place::Terminal { path } => path.clone(),
        }
    }

    pub fn port(&self) -> u16 {
        match self.place {
            Place::Network { port, .. } => port,
            Place::Terminal { .. } => 0,
        }
    }

    /// A T7 with an angle in millidegrees and its age in milliseconds; or one that does not answer.
    pub fn set(&self, slot: usize, value: Option<(i32, u16)>) {
        let mut registers = self.registers.lock().expect("no panic");
        let (angle, age, status) = match value {
            Some((mdeg, age)) => ([(mdeg >> 16) as u16, mdeg as u16], age, OK),
            None => (NO_ANGLE, NO_AGE, NO_ANSWER),
        };
        let (angles, ages) = places(slot);
        registers[angles..angles + 2].copy_from_slice(&angle);
        registers[ages] = age;
        registers[0xB0 + slot] = status;
        registers[0x100 + 0x20 * slot + 0x1E] = KIND_T7;
        registers[0x100 + 0x20 * slot + 0x1F] = slot as u16 + 1;
    }

    /// Another device than a gateway.
    pub fn forget_magic(&self) {
        self.registers.lock().expect("no panic")[0] = 0;
    }

    /// A bit for each slot with an alarm.
    pub fn alarms(&self, slots: u16) {
        self.registers.lock().expect("no panic")[0x1D] = slots;
    }

    /// Closes all connections, and lets no new one in.
    pub fn vanish(self) {}
}

impl Drop for Registers {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Place::Network { port, streams } = &self.place {
            for stream in streams.lock().expect("no panic").drain(..) {
                let _ = stream.shutdown(Shutdown::Both);
            }
            // Wakes up the listener, which ends.
            let _ = TcpStream::connect(("127.0.0.1", *port));
        }
    }
}

/// A gateway of version 0.1.0 in its second start since the third power-up, without a sensor.
fn empty() -> Vec<u16> {
    let mut registers = vec![0; REGISTERS];
    // "INCL", and the version of the map.
    registers[..3].copy_from_slice(&[0x494E, 0x434C, 2]);
    registers[6] = 0x0001;
    registers[0x0985] = 2;
    registers[0x09AF] = 3;
    for slot in 0..48 {
        let (angles, ages) = places(slot);
        registers[angles..angles + 2].copy_from_slice(&NO_ANGLE);
        registers[ages] = NO_AGE;
        registers[0xB0 + slot] = DISABLED;
    }
    registers
}

/// Registers of a slot's angle and of its age.
fn places(slot: usize) -> (usize, usize) {
    match slot.checked_sub(32) {
        None => (0x20 + 2 * slot, 0x60 + slot),
        Some(second) => (0x80 + 2 * second, 0xA0 + second),
    }
}

fn serve(framing: Framing, mut stream: TcpStream, registers: &Mutex<Vec<u16>>) {
    let mut received = Vec::new();
    let mut buffer = [0; 256];
    while let Ok(count @ 1..) = stream.read(&mut buffer) {
        received.extend_from_slice(&buffer[..count]);
        while let Some(answer) = answer(framing, &mut received, registers) {
            if stream.write_all(&answer).is_err() {
                return;
            }
        }
    }
}

/// The answer to the first request of what was received, if it is whole.
fn answer(framing: Framing, received: &mut Vec<u8>, registers: &Mutex<Vec<u16>>) -> Option<Vec<u8>> {
    // Address, function, first register, count; behind a header or before a CRC.
    let (head, length) = if framing == Framing::Tcp { (6, 12) } else { (0, 8) };
    if received.len() < length {
        return None;
    }
    let request: Vec<u8> = received.drain(..length).collect();
    let [unit, function, high, low, _, count] = request[head..head + 6] else { return None };
    assert_eq!((unit, function), (1, 3), "{request:02X?}");
    let first = usize::from(u16::from_be_bytes([high, low]));
    let registers = registers.lock().expect("no panic");
    let values = &registers[first..first + usize::from(count)];
    let mut message = vec![unit, function, 2 * count];
    message.extend(values.iter().flat_map(|value| value.to_be_bytes()));
    if framing == Framing::Tcp {
        let length = u16::try_from(message.len()).expect("short").to_be_bytes();
        return Some([&request[..4], &length, &message].concat());
    }
    let sum = crc(&request[..6]).to_le_bytes();
    assert_eq!(request[6..], sum, "a CRC");
    message.extend(crc(&message).to_le_bytes());
    Some(message)
}

/// CRC-16 of *MODBUS over Serial Line*, section 6.2.2: reflected 0x8005, from all ones.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 0 { crc >> 1 } else { crc >> 1 ^ 0xA001 })
    })
}
