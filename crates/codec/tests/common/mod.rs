//! Shared by the tests: the documented vectors, and frame arithmetic written a second time from the documents.
#![allow(dead_code, reason = "every test program uses its own part")]

use clino_codec::character::Character;
use serde_json::Value;

/// One line of `vectors/documented.jsonl`.
pub fn vectors(protocol: &str) -> Vec<Value> {
    include_str!("../vectors/documented.jsonl")
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("the vectors are JSON"))
        .filter(|vector| vector["protocol"] == protocol)
        .collect()
}

/// The documented frames of a protocol and a direction.
pub fn frames(protocol: &str, kind: &str) -> Vec<Vec<u8>> {
    vectors(protocol).iter().filter(|vector| vector["kind"] == kind).map(bytes_of).collect()
}

pub fn bytes_of(vector: &Value) -> Vec<u8> {
    hex(vector["hex"].as_str().expect("a frame has bytes"))
}

pub fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("hex")).collect()
}

/// A T7 frame: address, length, command, body, and for all but Get commands the byte that makes the sum zero.
pub fn t7_frame(address: u8, command: u8, body: &[u8], summed: bool) -> Vec<u8> {
    let mut frame = vec![address, (1 + body.len() + usize::from(summed)) as u8, command];
    frame.extend(body);
    if summed {
        let total: u32 = frame.iter().map(|&byte| u32::from(byte)).sum();
        frame.push(((256 - total % 256) % 256) as u8);
    }
    frame
}

/// An ISU frame: length, head, payload, low byte of the sum of head and payload.
pub fn isu_frame(head: u8, payload: &[u8]) -> Vec<u8> {
    let mut frame = vec![(1 + payload.len()) as u8, head];
    frame.extend(payload);
    let total: u32 = frame[1..].iter().map(|&byte| u32::from(byte)).sum();
    frame.push((total % 256) as u8);
    frame
}

pub fn clean(bytes: &[u8]) -> impl Iterator<Item = Character> {
    bytes.iter().copied().map(Character::clean)
}

/// Every frame that differs from this one in exactly one bit.
pub fn single_bit_errors(frame: &[u8]) -> impl Iterator<Item = Vec<u8>> {
    (0..frame.len() * 8).map(|bit| {
        let mut damaged = frame.to_vec();
        damaged[bit / 8] ^= 1 << (bit % 8);
        damaged
    })
}
