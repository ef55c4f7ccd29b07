//! One angle in every view of the image: console, JSON, and all copies of the Modbus map.
//! Every code and every soft zero are in `crates/modbus/tests/views.rs`.

use clino_host_tests::{Ran, modbus, run};

/// The soft zero of slot 3: 0x1000 + 3 · 0x20 + 10 (`docs/modbus.md`).
const ZERO_OF_3: u16 = 0x106A;
/// Blocks of 4 registers and less at these addresses: int32, float32, int16, and both again low word first; of slot 3.
const VIEWS: [(u16, u16); 6] = [(0x0026, 2), (0x0706, 2), (0x0763, 1), (0x0806, 2), (0x0866, 2), (0x0162, 5)];

/// Function 4 for this many registers.
fn read((first, quantity): (u16, u16)) -> Vec<u8> {
    let ([f, g], [q, r]) = (first.to_be_bytes(), quantity.to_be_bytes());
    vec![4, f, g, q, r]
}

/// An ISU at an angle, and the soft zero of its slot written over Modbus, in 0.001°; then every view read.
fn written(degrees: f64, zero_mdeg: i32, range: &str) -> (Ran, Vec<Vec<u16>>) {
    let [a, b, c, d] = zero_mdeg.to_be_bytes();
    let [f, g] = ZERO_OF_3.to_be_bytes();
    let mut scenario = format!(
        r#"
        seed = 1
        duration = "4s"
        isu = [{{ address = 1, motion.constant = {degrees:?} }}]
        typed = [
            {{ at = "100ms", line = "set 3 range {range}" }},
            {{ at = "2500ms", line = "read 3" }},
            {{ at = "2600ms", line = "list" }},
        ]
        [modbus]
        "#
    );
    scenario += &modbus::request(&[16, f, g, 0, 2, 4, a, b, c, d], 800);
    for (at, view) in (3_000..).step_by(100).zip(VIEWS) {
        scenario += &modbus::request(&read(view), at);
    }
    let ran = run(&scenario);
    let exchanges = modbus::exchanges(&ran.bus_log);
    assert_eq!(exchanges.len(), 1 + VIEWS.len());
    let registers = exchanges.iter().skip(1).map(|exchange| exchange.registers().expect("an answer"));
    let registers = registers.collect();
    (ran, registers)
}

fn wide(high: u16, low: u16) -> u32 {
    u32::from(high) << 16 | u32::from(low)
}

/// Checks that everything says `mdeg`.
fn check(degrees: f64, zero_mdeg: i32, range: &str, mdeg: i32) {
    let (ran, views) = written(degrees, zero_mdeg, range);
    let what = format!("{degrees}° less {zero_mdeg} m°, {range}");
    let [int32, float, int16, int32_cdab, float_cdab, block] = &views[..] else { panic!("{what}") };
    assert_eq!(wide(int32[0], int32[1]) as i32, mdeg, "{what}");
    assert_eq!(wide(int32_cdab[1], int32_cdab[0]) as i32, mdeg, "{what}");
    assert_eq!(wide(block[0], block[1]) as i32, mdeg, "{what}");
    let nearest = (f64::from(mdeg) / 1_000.0) as f32;
    assert_eq!(f32::from_bits(wide(float[0], float[1])), nearest, "{what}");
    assert_eq!(f32::from_bits(wide(float_cdab[1], float_cdab[0])), nearest, "{what}");
    assert_eq!(f32::from_bits(wide(block[2], block[3])), nearest, "{what}");
    let hundredths = i32::from(int16[0].cast_signed());
    assert_eq!(block[4], int16[0]);
    assert!((-18_000..18_000).contains(&hundredths), "{what}: {hundredths}");
    let off = (hundredths * 10 - mdeg).rem_euclid(360_000);
    assert!(off.min(360_000 - off) <= 5, "{what}: {hundredths}");
    // On the console: the stream, `read` and `list`.
    let text = format!(r#""angle_deg":{:.3},"#, f64::from(mdeg) / 1_000.0);
    let after = |at: u64| ran.lines.iter().filter(move |line| line.began > at * 1_000_000);
    let spoken: Vec<_> = after(2_000).filter(|line| line.text.starts_with(r#"{"slot":3,"#)).collect();
    assert!(spoken.len() >= 3, "{what}");
    for line in spoken {
        assert!(line.text.contains(&text), "{what}: {}", line.text);
    }
}

/// The issue's example: code 2 is 0.010986°, which reads as 0.011. Written to the soft zero, it read 360000 for good.
#[test]
fn the_angle_that_was_read_written_to_the_soft_zero_gives_zero() {
    check(0.011, 11, "unidirectional", 0);
    check(0.011, 11, "bidirectional", 0);
}

/// Code 0x7FFF is 179.994507°: less −0.005 it is half a turn but for 0.5 µ°, which rounds to the end of the range.
#[test]
fn the_end_of_either_range_is_its_beginning() {
    check(179.9945, -5, "bidirectional", -180_000);
    check(359.9945, -5, "unidirectional", 0);
}
