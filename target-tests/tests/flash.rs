//! The firmware's flash driver on the real sectors of the configuration. **Stored settings are lost.**
//!
//! Limits: DS8626 table 40 (erase of 16 KiB: 250 ms typical, 500 ms at most; a word: 16 us typical, 100 us at most).

#![no_std]
#![no_main]

#[path = "../../src/flash.rs"]
#[allow(dead_code, reason = "the tally's sector is only ever programmed: no test spends its bits")]
mod flash;

mod board {
    pub use stm32f4xx_hal::pac::FLASH as FlashRegisters;
}

mod watchdog {
    /// No watchdog runs here.
    pub fn look() {}
}

#[embedded_test::tests]
mod tests {
    use embedded_storage::nor_flash::{NorFlash as _, ReadNorFlash as _};
    use stm32f4xx_hal::pac;
    use target_tests::{CORE_HZ, cycles, start};

    use crate::flash::ConfigurationFlash;

    const SECTOR: u32 = 16 * 1024;
    const LONGEST_ERASE_MS: u32 = 500;
    const LONGEST_WORD_US: u32 = 100;
    const US: u32 = CORE_HZ / 1_000_000;

    #[init]
    fn init() -> ConfigurationFlash {
        let device = pac::Peripherals::take().unwrap();
        start(device.RCC, &mut cortex_m::Peripherals::take().unwrap());
        ConfigurationFlash::new(device.FLASH)
    }

    /// Every byte of a sector is this.
    fn is_all(flash: &mut ConfigurationFlash, sector: u32, byte: u8) -> bool {
        let mut piece = [0; 64];
        (0..SECTOR / 64).all(|at| {
            flash.read(sector * SECTOR + at * 64, &mut piece).unwrap();
            piece.iter().all(|read| *read == byte)
        })
    }

    #[test]
    fn each_sector_is_erased_alone_and_in_time(mut flash: ConfigurationFlash) {
        for sector in 0..3 {
            flash.erase(sector * SECTOR, (sector + 1) * SECTOR).unwrap();
            flash.write(sector * SECTOR, &[0x00; 64]).unwrap();
        }
        for sector in 0..3 {
            let taken = cycles(|| flash.erase(sector * SECTOR, (sector + 1) * SECTOR).unwrap());
            defmt::info!("sector {}: erased in {} us", sector + 1, taken / US);
            assert!(taken / US / 1_000 <= LONGEST_ERASE_MS);
            assert!(is_all(&mut flash, sector, 0xFF));
            // The next one is as it was.
            let mut first = [0xFF; 64];
            if sector < 2 {
                flash.read((sector + 1) * SECTOR, &mut first).unwrap();
                assert_eq!(first, [0; 64]);
            }
        }
    }

    #[test]
    fn words_are_programmed_in_time_and_read_back(mut flash: ConfigurationFlash) {
        flash.erase(0, SECTOR).unwrap();
        let mut longest = 0;
        for word in 0..SECTOR / 4 {
            let pattern = word.wrapping_mul(0x9E37_79B9).to_le_bytes();
            longest = longest.max(cycles(|| flash.write(word * 4, &pattern).unwrap()));
            let mut read = [0; 4];
            flash.read(word * 4, &mut read).unwrap();
            assert_eq!(read, pattern);
        }
        defmt::info!("a word: {} us at most", longest / US);
        // The driver's own instructions are in it.
        assert!(longest / US <= LONGEST_WORD_US + 10);
    }

    #[test]
    fn a_word_can_lose_bits_and_not_gain_them(mut flash: ConfigurationFlash) {
        flash.erase(0, SECTOR).unwrap();
        flash.write(0, &[0x0F; 4]).unwrap();
        let _ = flash.write(0, &[0xF3; 4]);
        let mut read = [0; 4];
        flash.read(0, &mut read).unwrap();
        assert_eq!(read, [0x03; 4]);
    }

    #[test]
    fn nothing_outside_is_touched(mut flash: ConfigurationFlash) {
        assert!(flash.write(3 * SECTOR, &[0; 4]).is_err());
        assert!(flash.write(2, &[0; 4]).is_err());
        assert!(flash.erase(0, 4 * SECTOR).is_err());
        assert!(flash.erase(1, SECTOR).is_err());
    }
}
