//! What the Modbus port carried, decoded from the wire log.
//!
//! The sender and silences separate the frames; checksums are made here, bit by bit, from the specification
//! (MODBUS over Serial Line V1.02, section 6.2.2).

/// A frame on the wire.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// The gateway sent it, not the master.
    pub from_gateway: bool,
    /// First start bit, ns since power-up.
    pub begin: u64,
    /// End of the last stop bit.
    pub end: u64,
    /// All bytes, the checksum included.
    pub bytes: Vec<u8>,
}

/// A request and its answer, if there was one.
#[derive(Clone, Debug)]
pub struct Exchange {
    /// What the master sent.
    pub request: Frame,
    /// What came back.
    pub answer: Option<Frame>,
}

impl Exchange {
    /// From the end of the request to the first start bit of the answer, in ns.
    pub fn wait(&self) -> Option<u64> {
        Some(self.answer.as_ref()?.begin - self.request.end)
    }

    /// The registers in an intact answer to a reading request.
    pub fn registers(&self) -> Option<Vec<u16>> {
        let [_, 3 | 4, count, data @ ..] = self.answer.as_ref()?.bytes.as_slice() else { return None };
        let data = data.get(..usize::from(*count))?;
        Some(data.chunks(2).map(|word| u16::from_be_bytes([word[0], word[1]])).collect())
    }
}

/// A silence longer than this is between two frames, ns: longer than a character at 9600 bit/s.
const SILENCE: u64 = 1_200_000;

/// The exchanges in a bus log.
///
/// # Panics
/// The log is none, or an answer's checksum is wrong.
pub fn exchanges(bus_log: &[u8]) -> Vec<Exchange> {
    let mut exchanges: Vec<Exchange> = Vec::new();
    for frame in frames(bus_log) {
        match (frame.from_gateway, exchanges.last_mut()) {
            (false, _) => exchanges.push(Exchange { request: frame, answer: None }),
            (true, Some(exchange)) if exchange.answer.is_none() => {
                assert_eq!(crc(&frame.bytes), 0, "checksum of {frame:?}");
                exchange.answer = Some(frame);
            }
            (true, _) => panic!("an answer without a request: {frame:?}"),
        }
    }
    exchanges
}

fn frames(bus_log: &[u8]) -> Vec<Frame> {
    let text = std::str::from_utf8(bus_log).expect("the bus log is text");
    let mut frames: Vec<Frame> = Vec::new();
    for line in text.lines() {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let [begin, "modbus", "char", who, word, end, ..] = fields[..] else { continue };
        let begin = begin.parse().expect("a time");
        let end = end.strip_prefix("end=").and_then(|end| end.parse().ok()).expect("a time");
        let word = u16::from_str_radix(word, 16).expect("a character");
        let (byte, from_gateway) = ((word & 0xFF) as u8, who == "gateway");
        match frames.last_mut() {
            Some(frame) if frame.from_gateway == from_gateway && begin < frame.end + SILENCE => {
                frame.bytes.push(byte);
                frame.end = end;
            }
            _ => frames.push(Frame { from_gateway, begin, end, bytes: vec![byte] }),
        }
    }
    frames
}

/// A request with its checksum, as a scenario writes it.
pub fn request(pdu: &[u8], at_ms: u64) -> String {
    let bytes: Vec<String> = frame(pdu).iter().map(|byte| format!("{byte:02x}")).collect();
    format!("[[modbus.request]]\nat = \"{at_ms}ms\"\nbytes = \"{}\"\n", bytes.join(" "))
}

/// A request to address 1 with its checksum.
pub fn frame(pdu: &[u8]) -> Vec<u8> {
    let mut frame = vec![1];
    frame.extend_from_slice(pdu);
    frame.extend_from_slice(&crc(&frame).to_le_bytes());
    frame
}

/// Zero over a frame with its checksum.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, &byte| {
        (0..8).fold(crc ^ u16::from(byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xA001 } else { crc >> 1 })
    })
}
