//! A plan never touches the upper 14 bits, and leaves a sound image sound and as wished.
//!
//! Input: what to change, its value, then the words.
#![no_main]

use clino_codec::isu::Address;
use clino_codec::isu::eeprom::{Change, ChecksumReading, DataWord, Image, Plan, ShutoffBit};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let [kind, high, low, content @ ..] = input else { return };
    let value = u16::from_be_bytes([*high, *low]);
    let mut image = Image::new([0; 256]);
    image.fill(0, content.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])));
    let change = match kind % 4 {
        0 => Change::NullPosition(value),
        1 => Change::ModuleAddress(Address::try_from(low % 16).unwrap()),
        2 => Change::AutoShutoff { bit: ShutoffBit::Bit0, enabled: value & 1 == 1 },
        _ => Change::AutoShutoff { bit: ShutoffBit::Bit7, enabled: value & 1 == 1 },
    };
    let reading =
        if kind & 4 == 0 { ChecksumReading::UpperBitsCounted } else { ChecksumReading::WordsLeftOut };
    let before = image.clone();
    if !image.audit().is_sound() {
        assert!(Plan::change(&image, change).is_err());
    }
    Plan::repair(&image, reading).apply(&mut image);
    assert!(image.audit().holds(reading));
    if let Ok(plan) = Plan::change(&image, change) {
        plan.apply(&mut image);
        assert!(image.audit().holds(reading));
        match change {
            Change::NullPosition(value) => assert_eq!(image.data(DataWord::NullPosition), value),
            Change::ModuleAddress(address) => assert_eq!(image.module_address(), address),
            Change::AutoShutoff { .. } => {}
        }
    }
    for (old, new) in before.words().iter().zip(image.words()) {
        assert_eq!(old >> 2, new >> 2);
    }
});
