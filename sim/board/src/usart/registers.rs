//! The USART's registers and flags, without time (RM0090 §30.6).

use clino_segment::wire::Received;

use crate::reception::Reception;

/// Status register.
pub(super) mod sr {
    pub const PE: u16 = 1 << 0;
    pub const FE: u16 = 1 << 1;
    pub const NF: u16 = 1 << 2;
    pub const ORE: u16 = 1 << 3;
    pub const IDLE: u16 = 1 << 4;
    pub const RXNE: u16 = 1 << 5;
    pub const TC: u16 = 1 << 6;
    pub const TXE: u16 = 1 << 7;
    /// LIN break and CTS: never set here, but cleared like the two above.
    pub const LBD_CTS: u16 = 3 << 8;
    /// Cleared by reading SR and then DR.
    pub const BY_READING: u16 = PE | FE | NF | ORE | IDLE;
    /// Cleared by writing 0.
    pub const BY_ZERO: u16 = RXNE | TC | LBD_CTS;
}

/// Control register 1.
pub(super) mod cr1 {
    pub const RE: u16 = 1 << 2;
    pub const TE: u16 = 1 << 3;
    pub const IDLEIE: u16 = 1 << 4;
    pub const RXNEIE: u16 = 1 << 5;
    pub const TCIE: u16 = 1 << 6;
    pub const TXEIE: u16 = 1 << 7;
    pub const PEIE: u16 = 1 << 8;
    pub const PS: u16 = 1 << 9;
    pub const PCE: u16 = 1 << 10;
    pub const M: u16 = 1 << 12;
    pub const UE: u16 = 1 << 13;
    pub const OVER8: u16 = 1 << 15;
    /// Bit 14 is reserved; SBK (bit 0) is not modelled and reads as done.
    pub const WRITABLE: u16 = !(1 << 14 | 1 << 0);
}

/// Control register 3.
mod cr3 {
    pub const EIE: u16 = 1 << 0;
    pub const DMAR: u16 = 1 << 6;
    pub const ONEBIT: u16 = 1 << 11;
    pub const WRITABLE: u16 = 0x0fff;
}

/// Stop bits in halves by CR2's STOP field, bits 13:12.
const STOP_HALVES: [u8; 4] = [2, 1, 4, 3];
const CR2_STOP_SHIFT: u32 = 12;
const CR2_WRITABLE: u16 = 0x7f6f;

/// Byte offsets.
pub(super) mod offset {
    pub const SR: u64 = 0x00;
    pub const DR: u64 = 0x04;
    pub const BRR: u64 = 0x08;
    pub const CR1: u64 = 0x0c;
    pub const CR2: u64 = 0x10;
    pub const CR3: u64 = 0x14;
    pub const GTPR: u64 = 0x18;
    /// Length of the block.
    pub const END: u64 = 0x1c;
}

/// Register file and flag logic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Registers {
    sr: u16,
    brr: u16,
    cr1: u16,
    cr2: u16,
    cr3: u16,
    gtpr: u16,
    /// Receive data register.
    received: u16,
    /// Transmit data register, while full.
    waiting: Option<u16>,
    /// Flags that the last read of SR showed: the first half of the sequences that clear them.
    seen: u16,
}

impl Default for Registers {
    fn default() -> Registers {
        Registers {
            sr: sr::TXE | sr::TC,
            brr: 0,
            cr1: 0,
            cr2: 0,
            cr3: 0,
            gtpr: 0,
            received: 0,
            waiting: None,
            seen: 0,
        }
    }
}

impl Registers {
    /// Value of the register at `offset`, without side effects.
    pub fn peek(&self, offset: u64) -> u16 {
        match offset {
            offset::SR => self.sr,
            offset::DR => self.received,
            offset::BRR => self.brr,
            offset::CR1 => self.cr1,
            offset::CR2 => self.cr2,
            offset::CR3 => self.cr3,
            offset::GTPR => self.gtpr,
            _ => 0,
        }
    }

    /// A read by firmware.
    pub fn read(&mut self, offset: u64) -> u16 {
        let value = self.peek(offset);
        match offset {
            offset::SR => self.seen = self.sr,
            offset::DR => {
                self.sr &= !(sr::RXNE | self.seen & sr::BY_READING);
                self.seen &= !sr::BY_READING;
            }
            _ => {}
        }
        value
    }

    /// A write by firmware of the bits in `mask`.
    pub fn write(&mut self, offset: u64, value: u16, mask: u16) {
        let merged = |old: u16| old & !mask | value & mask;
        match offset {
            offset::SR => self.sr &= !(mask & !value & sr::BY_ZERO),
            offset::DR => self.write_data(value & mask),
            offset::BRR => self.brr = merged(self.brr),
            offset::CR1 => self.cr1 = merged(self.cr1) & cr1::WRITABLE,
            offset::CR2 => self.cr2 = merged(self.cr2) & CR2_WRITABLE,
            offset::CR3 => self.cr3 = merged(self.cr3) & cr3::WRITABLE,
            offset::GTPR => self.gtpr = merged(self.gtpr),
            _ => {}
        }
    }

    fn write_data(&mut self, value: u16) {
        self.waiting = Some(value & 0x1ff);
        self.sr &= !(sr::TXE | self.seen & (sr::TC | sr::PE));
        self.seen &= !(sr::TC | sr::PE);
    }

    /// Whether all bits of `bits` are set in CR1.
    pub fn has(&self, bits: u16) -> bool {
        self.cr1 & bits == bits
    }

    /// Takes the waiting character for the shifter, with its parity bit in place.
    pub fn take_transmit(&mut self) -> Option<u16> {
        let word = self.waiting.take()?;
        self.sr |= sr::TXE;
        let top = 1 << (self.data_bits() - 1);
        let data = word & (top | (top - 1));
        if !self.has(cr1::PCE) {
            return Some(data);
        }
        let data = data & (top - 1);
        let odd_ones = data.count_ones() % 2 == 1;
        Some(if odd_ones != self.has(cr1::PS) { data | top } else { data })
    }

    /// The last stop bit has gone and nothing waits.
    pub fn transmission_complete(&mut self) {
        self.sr |= sr::TC;
    }

    /// A character arrived; says which flags it has raised.
    pub fn receive(&mut self, received: Received) -> Reception {
        let Received { at, word, framing_error, noise } = received;
        let clean = Reception { at, word, ..Reception::default() };
        if self.sr & sr::RXNE != 0 {
            // The old character stays; of the new one only the overrun is reported (RM0090 §30.6.1, ORE and FE).
            self.sr |= sr::ORE;
            return Reception { overrun: true, ..clean };
        }
        self.received = word;
        self.sr |= sr::RXNE;
        let odd_ones = word.count_ones() % 2 == 1;
        let reception = Reception {
            framing: framing_error,
            noise: noise && self.cr3 & cr3::ONEBIT == 0,
            parity: self.has(cr1::PCE) && odd_ones != self.has(cr1::PS),
            ..clean
        };
        for (is, flag) in [(reception.framing, sr::FE), (reception.noise, sr::NF), (reception.parity, sr::PE)]
        {
            if is {
                self.sr |= flag;
            }
        }
        reception
    }

    /// Sets status flags.
    pub fn raise(&mut self, flags: u16) {
        self.sr |= flags;
    }

    /// Level of the interrupt line (RM0090 table 148).
    pub fn interrupt(&self) -> bool {
        let enabled = |enable: u16, flags: u16| self.cr1 & enable != 0 && self.sr & flags != 0;
        enabled(cr1::TXEIE, sr::TXE)
            || enabled(cr1::TCIE, sr::TC)
            || enabled(cr1::RXNEIE, sr::RXNE | sr::ORE)
            || enabled(cr1::PEIE, sr::PE)
            || enabled(cr1::IDLEIE, sr::IDLE)
            || self.cr3 & (cr3::EIE | cr3::DMAR) == cr3::EIE | cr3::DMAR
                && self.sr & (sr::FE | sr::ORE | sr::NF) != 0
    }

    /// Length of a bit in bus clocks.
    pub fn bit_ticks(&self) -> u64 {
        if self.has(cr1::OVER8) {
            u64::from(self.brr >> 4) * 8 + u64::from(self.brr & 0x7)
        } else {
            u64::from(self.brr)
        }
    }

    /// Bits between start and stop bit, parity included.
    pub fn data_bits(&self) -> u8 {
        if self.has(cr1::M) { 9 } else { 8 }
    }

    /// Stop bits in halves.
    pub fn stop_halves(&self) -> u8 {
        STOP_HALVES[usize::from(self.cr2 >> CR2_STOP_SHIFT & 3)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: u16 = 0xffff;

    fn heard(word: u16) -> Received {
        Received { at: 0, word, framing_error: false, noise: false }
    }

    #[test]
    fn tc_is_cleared_by_reading_sr_and_then_writing_dr_only() {
        let mut usart = Registers::default();
        usart.write(offset::DR, 0x41, ALL);
        assert_eq!(usart.peek(offset::SR), sr::TC);
        usart.take_transmit();
        assert_eq!(usart.read(offset::SR), sr::TC | sr::TXE);
        usart.write(offset::DR, 0x42, ALL);
        assert_eq!(usart.peek(offset::SR), 0);
    }

    #[test]
    fn a_write_of_zero_clears_tc_and_rxne_and_nothing_else() {
        let mut usart = Registers::default();
        usart.receive(heard(0x41));
        usart.receive(heard(0x42));
        usart.write(offset::SR, !sr::TC, ALL);
        assert_eq!(usart.peek(offset::SR), sr::TXE | sr::RXNE | sr::ORE);
        usart.write(offset::SR, 0, ALL);
        assert_eq!(usart.peek(offset::SR), sr::TXE | sr::ORE);
        // A byte access leaves the bits of the other byte alone.
        usart.raise(sr::TC);
        usart.write(offset::SR, 0, 0xff00);
        assert_eq!(usart.peek(offset::SR), sr::TXE | sr::TC | sr::ORE);
    }

    #[test]
    fn an_error_flag_stays_until_sr_and_then_dr_are_read() {
        let mut usart = Registers::default();
        usart.receive(Received { framing_error: true, ..heard(0x41) });
        usart.read(offset::DR);
        assert_eq!(usart.peek(offset::SR), sr::TXE | sr::TC | sr::FE);
        usart.read(offset::SR);
        usart.read(offset::DR);
        assert_eq!(usart.peek(offset::SR), sr::TXE | sr::TC);
    }

    #[test]
    fn an_overrun_keeps_the_old_character_and_hides_the_flags_of_the_new() {
        let mut usart = Registers::default();
        usart.receive(heard(0x41));
        usart.receive(Received { framing_error: true, noise: true, ..heard(0x42) });
        assert_eq!(usart.read(offset::SR), sr::TXE | sr::TC | sr::RXNE | sr::ORE);
        assert_eq!(usart.read(offset::DR), 0x41);
        assert_eq!(usart.peek(offset::SR), sr::TXE | sr::TC);
    }

    #[test]
    fn an_overrun_after_sr_was_read_survives_the_read_of_dr() {
        let mut usart = Registers::default();
        usart.receive(heard(0x41));
        usart.read(offset::SR);
        usart.receive(heard(0x42));
        usart.read(offset::DR);
        assert_eq!(usart.peek(offset::SR), sr::TXE | sr::TC | sr::ORE);
    }

    #[test]
    fn parity_takes_the_top_data_bit() {
        let mut usart = Registers::default();
        // (CR1, data written, word sent): 8E1 with 9 bits, 7O1 with 8 bits, 8N1.
        for (cr1, data, word) in [
            (cr1::M | cr1::PCE, 0x07, 0x107),
            (cr1::M | cr1::PCE, 0x103, 0x003),
            (cr1::PCE | cr1::PS, 0x03, 0x83),
            (cr1::PCE | cr1::PS, 0x07, 0x07),
            (0, 0x1a5, 0x0a5),
        ] {
            usart.write(offset::CR1, cr1, ALL);
            usart.write(offset::DR, data, ALL);
            assert_eq!(usart.take_transmit(), Some(word), "CR1 {cr1:#06x}");
            usart.receive(heard(word));
            assert_eq!(usart.read(offset::SR) & sr::PE, 0);
            usart.read(offset::DR);
            if cr1 != 0 {
                usart.receive(heard(word ^ 1));
                assert_eq!(usart.read(offset::SR) & sr::PE, sr::PE);
                usart.read(offset::DR);
            }
        }
    }

    #[test]
    fn each_interrupt_needs_its_flag_and_its_enable() {
        // RM0090 table 148.
        for (enable, flag) in [
            (cr1::TXEIE, sr::TXE),
            (cr1::TCIE, sr::TC),
            (cr1::RXNEIE, sr::RXNE),
            (cr1::RXNEIE, sr::ORE),
            (cr1::PEIE, sr::PE),
            (cr1::IDLEIE, sr::IDLE),
        ] {
            let mut usart = Registers { sr: 0, ..Registers::default() };
            usart.write(offset::CR1, enable, ALL);
            assert!(!usart.interrupt());
            usart.raise(flag);
            assert!(usart.interrupt());
            usart.write(offset::CR1, !enable, ALL);
            assert!(!usart.interrupt());
        }
        let mut usart = Registers { sr: sr::FE, ..Registers::default() };
        usart.write(offset::CR3, cr3::EIE, ALL);
        assert!(!usart.interrupt(), "EIE counts with DMA reception only");
        usart.write(offset::CR3, cr3::EIE | cr3::DMAR, ALL);
        assert!(usart.interrupt());
    }

    #[test]
    fn bit_length_and_framing_follow_the_registers() {
        let mut usart = Registers::default();
        usart.write(offset::BRR, 0x16d, ALL);
        assert_eq!((usart.bit_ticks(), usart.data_bits(), usart.stop_halves()), (0x16d, 8, 2));
        usart.write(offset::CR1, cr1::OVER8 | cr1::M, ALL);
        usart.write(offset::CR2, 0b10 << 12, ALL);
        assert_eq!((usart.bit_ticks(), usart.data_bits(), usart.stop_halves()), (22 * 8 + 5, 9, 4));
    }
}
