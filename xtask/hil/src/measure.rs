//! What a capture of a pair and its driver enable tells: bit times of the gateway, and how DE lies around its frames.
//!
//! A character begins at a falling edge of the idle line and has ten bits (8N1). Its bit time is measured between its start
//! and its last edge, to which the nominal rate gives the number of bits.

use crate::capture::{BITS, Line};

/// Smallest and largest of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The smallest.
    pub least: f64,
    /// The largest.
    pub most: f64,
}

impl Range {
    fn add(range: &mut Option<Range>, value: f64) {
        let range = range.get_or_insert(Range { least: value, most: value });
        range.least = range.least.min(value);
        range.most = range.most.max(value);
    }
}

/// The figures of a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Frames of the gateway: DE was high, and characters came.
    pub frames: usize,
    /// Mean bit time of the gateway, ns.
    pub bit_ns: f64,
    /// DE high to the first start bit, in bits.
    pub lead_bits: Option<Range>,
    /// End of the last stop bit to DE low, ns; negative where the stop bit was cut.
    pub tail_ns: Option<Range>,
    /// Of those, frames with a low stop bit; their times do not count.
    pub broken: usize,
}

/// Measures the frames, from DE's rise to its fall, that are not `disturbed` by something that is not the gateway's doing.
pub fn measure(pair: &Line, de: &Line, disturbed: impl Fn(u64, u64) -> bool, baud: u64) -> Figures {
    let nominal = 1e9 / baud as f64;
    let mut figures = Figures::default();
    let (mut time, mut bits) = (0.0, 0.0);
    let mut last_of_frames = Vec::new();
    for (rise, fall) in de.highs().into_iter().filter(|&(rise, fall)| !disturbed(rise, fall)) {
        let mut at = rise;
        let mut last_start = None;
        let mut first_start = None;
        let (time_before, bits_before, mut broken) = (time, bits, 0);
        while let Some(start) = pair.falling(at).filter(|start| *start < fall) {
            first_start = first_start.or(Some(start));
            last_start = Some(start);
            let end = start + (BITS as f64 * nominal) as u64;
            let half = (nominal / 2.0) as u64;
            if let Some(edge) = pair.last_edge(start, end - half) {
                let length = (edge - start) as f64;
                let count = (length / nominal).round();
                (time, bits) = (time + length, bits + count);
            }
            broken += usize::from(!pair.level(end - half));
            at = end - half;
        }
        let (Some(first), Some(last)) = (first_start, last_start) else { continue };
        figures.frames += 1;
        figures.broken += usize::from(broken > 0);
        if broken > 0 {
            // Another driver has been on: nothing of the frame is the gateway's alone.
            (time, bits) = (time_before, bits_before);
            continue;
        }
        Range::add(&mut figures.lead_bits, (first - rise) as f64 / nominal);
        last_of_frames.push((last, fall));
    }
    figures.bit_ns = if bits > 0.0 { time / bits } else { 0.0 };
    for (last, fall) in last_of_frames {
        Range::add(&mut figures.tail_ns, fall as f64 - (last as f64 + BITS as f64 * figures.bit_ns));
    }
    figures
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Characters at a bit time that is not the nominal one, DE around them.
    fn frame(bytes: &[u8], bit: u64, de: (u64, u64)) -> (Line, Line) {
        let mut pair = Line { initial: true, changes: Vec::new() };
        for (number, byte) in bytes.iter().enumerate() {
            let start = 1_000_000 + number as u64 * BITS * bit;
            let word = u64::from(*byte) << 1 | 1 << 9;
            for place in 0..BITS {
                pair.changes.push((start + place * bit, word >> place & 1 == 1));
            }
        }
        pair.changes.dedup_by_key(|change| change.1);
        (pair, Line { initial: false, changes: vec![(de.0, true), (de.1, false)] })
    }

    #[test]
    fn the_figures_are_those_of_the_wires() {
        // 3 characters of 8.7 us a bit from 1 ms on end at 1.261 ms.
        let (pair, de) = frame(&[0x01, 0x01, 0x83], 8_700, (999_000, 1_263_500));
        let figures = measure(&pair, &de, |_, _| false, 115_200);
        assert_eq!((figures.frames, figures.broken), (1, 0));
        assert!((figures.bit_ns - 8_700.0).abs() < 0.01, "{figures:?}");
        let (lead, tail) = (figures.lead_bits.unwrap(), figures.tail_ns.unwrap());
        assert!((lead.most - 1_000.0 / 8_680.6).abs() < 1e-3, "{figures:?}");
        assert!((tail.least - 2_500.0).abs() < 1.0, "{figures:?}");
    }

    #[test]
    fn a_cut_stop_bit_is_negative_and_a_break_is_broken() {
        let (pair, de) = frame(&[0x55], 8_681, (990_000, 1_080_000));
        assert!(measure(&pair, &de, |_, _| false, 115_200).tail_ns.unwrap().least < 0.0);
        let mut pair = pair;
        pair.changes = vec![(1_000_000, false), (1_200_000, true)];
        let de = Line { initial: false, changes: vec![(990_000, true), (1_100_000, false)] };
        assert_eq!(measure(&pair, &de, |_, _| false, 115_200).broken, 1);
    }

    #[test]
    fn a_disturbed_frame_is_not_judged() {
        let (pair, de) = frame(&[0x55], 8_681, (990_000, 1_040_000));
        assert_eq!(measure(&pair, &de, |_, _| false, 115_200).frames, 1);
        assert_eq!(measure(&pair, &de, |rise, fall| (rise, fall) == (990_000, 1_040_000), 115_200).frames, 0);
    }

    #[test]
    fn what_others_say_is_not_measured() {
        let (mut pair, de) = frame(&[0x55], 8_681, (990_000, 1_090_000));
        pair.changes.extend([(2_000_000, false), (2_020_000, true)]);
        assert_eq!(measure(&pair, &de, |_, _| false, 115_200).frames, 1);
    }
}
