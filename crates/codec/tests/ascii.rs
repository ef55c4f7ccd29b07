//! ISU ASCII: every line there can be, damage, and resynchronisation.

mod common;

use clino_codec::DecodeProgress;
use clino_codec::angle::Angle;
use clino_codec::ascii::{Centidegrees, LINE_LENGTH, LineDecoder, LineFault};
use clino_codec::character::{Character, LineErrors};
use common::clean;

fn run(decoder: &mut LineDecoder, bytes: &[u8]) -> Vec<Result<i16, LineFault>> {
    clean(bytes)
        .filter_map(|character| match decoder.push(character) {
            DecodeProgress::More => None,
            DecodeProgress::Frame(angle) => Some(Ok(angle.get())),
            DecodeProgress::Bad(fault) => Some(Err(fault)),
        })
        .collect()
}

fn once(bytes: &[u8]) -> Vec<Result<i16, LineFault>> {
    run(&mut LineDecoder::new(), bytes)
}

#[test]
fn every_angle_has_its_line_and_comes_back() {
    for centideg in -18_000..=18_000_i16 {
        let magnitude = centideg.unsigned_abs();
        let sign = if centideg < 0 { '-' } else { '+' };
        let line = format!("{sign}{:3}.{:02}\r\n", magnitude / 100, magnitude % 100);
        let angle = Centidegrees::new(centideg).unwrap();
        assert_eq!(angle.encode(), line.as_bytes());
        assert_eq!(once(line.as_bytes()), [Ok(centideg)]);
        assert_eq!(angle.angle(), Angle::from_udeg(i32::from(centideg) * 10_000));
        assert_eq!(Centidegrees::try_from(centideg), Ok(angle));
    }
    for centideg in [-18_001, 18_001, i16::MIN, i16::MAX] {
        assert_eq!(Centidegrees::new(centideg), None);
        assert_eq!(
            Centidegrees::try_from(centideg).unwrap_err().to_string(),
            format!("{centideg} hundredths of a degree are not within half a turn")
        );
    }
}

#[test]
fn blanks_may_stand_for_leading_zeros_only() {
    assert_eq!(once(b"+009.38\r\n"), [Ok(938)]);
    assert_eq!(once(b"-  0.00\r\n"), [Ok(0)]);
    assert_eq!(once(b"+ 09.38\r\n"), [Ok(938)]);
    let unexpected = |byte, position| [Err(LineFault::Unexpected { byte, position })];
    assert_eq!(once(b"+0 9.38\r\n")[..1], unexpected(b' ', 2));
    assert_eq!(once(b"+   .38\r\n")[..1], unexpected(b' ', 3));
    assert_eq!(once(b"+  9. 8\r\n")[..1], unexpected(b' ', 5));
    assert_eq!(once(b"+124 50\r\n")[..1], unexpected(b' ', 4));
    assert_eq!(once(b"+124.50\n\r")[..1], unexpected(b'\n', 7));
    assert_eq!(once(b"+124.50\r\r")[..1], unexpected(b'\r', 8));
}

#[test]
fn more_than_half_a_turn_is_refused() {
    assert_eq!(once(b"+180.00\r\n"), [Ok(18_000)]);
    assert_eq!(once(b"+180.01\r\n"), [Err(LineFault::Value { centideg: 18_001 })]);
    assert_eq!(once(b"-999.99\r\n"), [Err(LineFault::Value { centideg: -99_999 })]);
}

#[test]
fn reception_may_start_anywhere() {
    let lines = b"+124.50\r\n- 32.70\r\n";
    for skipped in 1..LINE_LENGTH {
        let mut decoder = LineDecoder::new();
        assert_eq!(run(&mut decoder, &lines[skipped..]), [Ok(-3_270)]);
        assert_eq!(decoder.discarded() as usize, LINE_LENGTH - skipped);
    }
}

#[test]
fn a_damaged_line_never_costs_the_next() {
    for cut in 1..LINE_LENGTH {
        let bytes = [&b"+124.50\r\n"[..cut], b"- 32.70\r\n"].concat();
        let seen = once(&bytes);
        assert_eq!(seen.last(), Some(&Ok(-3_270)), "{cut}");
        let fault = LineFault::Unexpected { byte: b'-', position: cut as u8 };
        assert_eq!(seen[0], Err(fault));
        assert_eq!(seen.len(), 2);
    }
    for position in 1..LINE_LENGTH {
        let mut bytes = *b"+124.50\r\n";
        bytes[position] = 0x00;
        let mut decoder = LineDecoder::new();
        let seen = run(&mut decoder, &[&bytes[..], b"- 32.70\r\n"].concat());
        let fault = LineFault::Unexpected { byte: 0, position: position as u8 };
        assert_eq!(seen, [Err(fault), Ok(-3_270)]);
        // The rest of the damaged line belongs to no line.
        assert_eq!(decoder.discarded() as usize, LINE_LENGTH - position - 1);
    }
}

#[test]
fn receiver_errors_make_a_line_dirty_even_if_it_reads_well() {
    for position in 0..LINE_LENGTH {
        let mut decoder = LineDecoder::new();
        let mut last = DecodeProgress::More;
        for (index, byte) in b"+124.50\r\n".iter().copied().enumerate() {
            let errors = if index == position { LineErrors::NOISE } else { LineErrors::NONE };
            last = decoder.push(Character { byte, errors });
        }
        assert_eq!(last, DecodeProgress::Bad(LineFault::LineErrors { errors: LineErrors::NOISE }));
        assert_eq!(run(&mut decoder, b"- 32.70\r\n"), [Ok(-3_270)]);
    }
    // They also explain a character that cannot stand there.
    let mut decoder = LineDecoder::default();
    _ = decoder.push(Character::clean(b'+'));
    let framing = decoder.push(Character { byte: 0, errors: LineErrors::FRAMING });
    assert_eq!(framing, DecodeProgress::Bad(LineFault::LineErrors { errors: LineErrors::FRAMING }));
}

#[test]
fn faults_say_what_was_seen() {
    let texts = [
        LineFault::LineErrors { errors: LineErrors::FRAMING }.to_string(),
        LineFault::Unexpected { byte: 0x20, position: 3 }.to_string(),
        LineFault::Value { centideg: 18_001 }.to_string(),
    ];
    assert_eq!(
        texts,
        [
            "receiver errors: LineErrors(1)",
            "character 20 at position 3 of a line",
            "18001 hundredths of a degree exceed half a turn",
        ]
    );
}
