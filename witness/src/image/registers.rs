//! Registers at rest: those of the pins as `docs/registers.md` has them, the others worked out here from the manual.

/// A register, and what it holds.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// Its name.
    pub name: String,
    /// Where it is.
    pub address: u64,
    /// The bits that are compared.
    pub mask: u32,
    /// What they are.
    pub value: u32,
}

/// A register of the core's own.
pub struct OfCore {
    pub name: &'static str,
    pub address: u64,
    pub mask: u32,
    pub value: u32,
}

/// Ports (RM0090 table 1), and the offsets of the registers in one (section 8.4).
const PORTS: [(char, u64); 4] =
    [('A', 0x4002_0000), ('B', 0x4002_0400), ('C', 0x4002_0800), ('D', 0x4002_0C00)];
const MODER: u64 = 0x00;
const OTYPER: u64 = 0x04;
const OSPEEDR: u64 = 0x08;
const PUPDR: u64 = 0x0C;
const AFRL: u64 = 0x20;
const AFRH: u64 = 0x24;

/// Name, address, mask, value.
const OTHERS: [(&str, u64, u32, u32); 16] = [
    // 84 MHz and 42 MHz by 115200, 9600 and 19200 bit/s.
    ("USART1_BRR", 0x4001_1008, u32::MAX, 729),
    ("USART2_BRR", 0x4000_4408, u32::MAX, 365),
    ("USART3_BRR", 0x4000_4808, u32::MAX, 4_375),
    ("USART6_BRR", 0x4001_1408, u32::MAX, 4_375),
    // UE, TE, RE, RXNEIE; parity; TXEIE and TCIE come and go.
    ("USART1_CR1", 0x4001_100C, !0xC0, 0x202C),
    ("USART6_CR1", 0x4001_140C, !0xC0, 0x342C),
    // A divider of 16, 1572 counts, both taken over.
    ("IWDG_PR", 0x4000_3004, u32::MAX, 2),
    ("IWDG_RLR", 0x4000_3008, u32::MAX, 1_571),
    ("IWDG_SR", 0x4000_300C, u32::MAX, 0),
    // Five wait states, prefetch, both caches.
    ("FLASH_ACR", 0x4002_3C00, u32::MAX, 0x705),
    ("FLASH_CR", 0x4002_3C10, 0x8000_0000, 0x8000_0000),
    // HSION, HSEON, CSSON, PLLON; AHB whole, APB1 a quarter, APB2 a half, the PLL in use.
    ("RCC_CR", 0x4002_3800, 0x010D_0001, 0x0109_0001),
    ("RCC_CFGR", 0x4002_3808, 0xFCFF, 0x940A),
    ("RCC_APB1ENR", 0x4002_3840, u32::MAX, 0x0006_000D),
    ("RCC_APB2ENR", 0x4002_3844, u32::MAX, 0x30),
    ("DBGMCU_APB1_FZ", 0xE004_2008, 1 << 12, 1 << 12),
];

/// The word of `NVIC_IPR` with an interrupt's priority, and the byte of it.
const fn priority(name: &'static str, interrupt: u32, priority: u32) -> OfCore {
    let shift = 8 * (interrupt % 4);
    OfCore {
        name,
        address: 0xE000_E400 + interrupt as u64 / 4 * 4,
        mask: 0xFF << shift,
        value: priority << shift,
    }
}

/// The core's own registers. Priorities are those of `docs/architecture.md`: a level of 4 is the core's 12, of 16 steps.
pub const CORE: [OfCore; 13] = [
    priority("priority of USART1", 37, 12 << 4),
    priority("priority of USART3", 39, 12 << 4),
    priority("priority of TIM5", 50, 12 << 4),
    priority("priority of TIM2", 28, 12 << 4),
    priority("priority of TIM4", 30, 12 << 4),
    priority("priority of USART2", 38, 13 << 4),
    priority("priority of USART6", 71, 13 << 4),
    priority("priority of EXTI0", 6, 14 << 4),
    priority("priority of EXTI1", 7, 15 << 4),
    // SysTick: above all.
    OfCore { name: "SHPR3", address: 0xE000_ED20, mask: 0xFF00_0000, value: 0 },
    // No group priority; the single fault handlers are off; the table is at 0.
    OfCore { name: "AIRCR", address: 0xE000_ED0C, mask: 0x700, value: 0 },
    OfCore { name: "SHCSR", address: 0xE000_ED24, mask: 0x0007_0000, value: 0 },
    OfCore { name: "VTOR", address: 0xE000_ED08, mask: u32::MAX, value: 0 },
];

/// Every register in the part's peripherals that is compared.
pub fn wanted(document: &str) -> Result<Vec<Wanted>, String> {
    let mut wanted = pins(document)?;
    let others = OTHERS.iter().map(|(name, address, mask, value)| Wanted {
        name: (*name).to_owned(),
        address: *address,
        mask: *mask,
        value: *value,
    });
    wanted.extend(others);
    Ok(wanted)
}

/// Those of the pins, from the table of the document.
fn pins(document: &str) -> Result<Vec<Wanted>, String> {
    let missing = |what: &str| format!("docs/registers.md has no row of {what} that can be read");
    let row = |name: &str| {
        let begin = format!("| `{name}`");
        let line = document.lines().find(|line| line.starts_with(&begin));
        let cells: Vec<String> =
            line.ok_or_else(|| missing(name))?.split('|').map(|cell| cell.trim().to_owned()).collect();
        match cells.as_slice() {
            // Nothing, name, reset value, set to, relied on, nothing.
            [_, _, reset, set, ..] => Ok(if set.is_empty() { reset.clone() } else { set.clone() }),
            _ => Err(missing(name)),
        }
    };
    let mut wanted = Vec::new();
    let mut add = |register: &str, offset: u64, values: [u32; 4]| {
        for ((port, base), value) in PORTS.iter().zip(values) {
            wanted.push(Wanted {
                name: format!("GPIO{port}_{register}"),
                address: base + offset,
                mask: u32::MAX,
                value,
            });
        }
    };
    for (name, offset) in [("MODER", MODER), ("PUPDR", PUPDR), ("OSPEEDR", OSPEEDR), ("OTYPER", OTYPER)] {
        add(name, offset, each_port(&row(name)?, 0).ok_or_else(|| missing(name))?);
    }
    // `A low, high; B low, high`.
    let functions = row("AFRL")?;
    add("AFRL", AFRL, each_port(&functions, 0).ok_or_else(|| missing("AFRL"))?);
    add("AFRH", AFRH, each_port(&functions, 1).ok_or_else(|| missing("AFRH"))?);
    Ok(wanted)
}

/// The value of each port in `A 0x1, B 0x2, C and D 0` or `A 0x1, 0x2; B 0x3, 0; …`, or the one of all: the number `nth` that
/// follows its letter.
fn each_port(cell: &str, nth: usize) -> Option<[u32; 4]> {
    let words = cell.split([' ', ',', ';']).filter(|word| !word.is_empty());
    let mut letters: Vec<char> = Vec::new();
    let mut values: [Vec<u32>; 4] = Default::default();
    let mut was_number = false;
    for word in words {
        match (word, word.chars().next().filter(|_| word.len() == 1)) {
            (_, Some(letter @ 'A'..='D')) => {
                if was_number {
                    letters.clear();
                }
                letters.push(letter);
                was_number = false;
            }
            ("and", _) => {}
            _ => {
                let value = match word.strip_prefix("0x") {
                    Some(digits) => u32::from_str_radix(digits, 16).ok()?,
                    None => word.parse().ok()?,
                };
                if letters.is_empty() {
                    letters = vec!['A', 'B', 'C', 'D'];
                }
                letters.iter().for_each(|letter| values[*letter as usize - 'A' as usize].push(value));
                was_number = true;
            }
        }
    }
    let [a, b, c, d] = values.map(|values| values.get(nth).copied());
    Some([a?, b?, c?, d?])
}

/// What is not as it should be.
pub fn wrong(document: &str, read: &[(u64, Option<u32>)]) -> Result<Vec<String>, String> {
    let wrong = wanted(document)?.into_iter().zip(read).filter_map(|(wanted, (_, value))| {
        let Wanted { name, mask, value: expected, .. } = wanted;
        match value {
            Some(value) if value & mask == expected => None,
            Some(value) => Some(format!("{name} {:#010x}, expected {expected:#010x}", value & mask)),
            None => Some(format!("{name} cannot be read")),
        }
    });
    Ok(wrong.collect())
}

/// The same of the core's own.
pub fn wrong_of_core(read: &[(u64, u32)]) -> Vec<String> {
    let wrong = CORE.iter().filter_map(|OfCore { name, address, mask, value }| {
        match read.iter().find(|(at, _)| at == address) {
            Some((_, seen)) if seen & mask == *value => None,
            Some((_, seen)) => Some(format!("{name} {:#010x}, expected {value:#010x}", seen & mask)),
            None => Some(format!("{name} was not read")),
        }
    });
    wrong.collect()
}

#[cfg(test)]
mod tests {
    use super::each_port;

    #[test]
    fn the_ways_in_which_the_document_writes_values_are_read() {
        assert_eq!(each_port("A 0xA8, B 0x280, C and D 0", 0), Some([0xA8, 0x280, 0, 0]));
        assert_eq!(each_port("A 0x7720, 0x10; B 0x77, 0; C 0x88, 0; D 0, 0x77", 1), Some([0x10, 0, 0, 0x77]));
        assert_eq!(each_port("0", 0), Some([0; 4]));
        assert_eq!(each_port("A 1, B 2", 0), None);
        assert_eq!(each_port("slow edges", 0), None);
    }
}
