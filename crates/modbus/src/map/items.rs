//! What a register of the map holds, by source.

use clino_gateway::Alarm;

/// What a register of the map is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item {
    /// Of the gateway as a whole.
    Gateway(GatewayItem),
    /// Of the value of a slot.
    Reading(ReadingItem),
    /// Of what else is known of a slot.
    Detail(DetailItem),
    /// Of what happened on a bus.
    Bus(BusItem),
    /// Of how the gateway has started.
    Start(StartItem),
    /// The setting of a slot with this id, in [`clino_gateway::settings::slot`].
    SlotSetting(u8),
    /// The setting of a bus with this id.
    BusSetting(u8),
    /// The setting of this server's port with this id.
    Port(u8),
    /// The setting of the console with this id.
    Console(u8),
    /// Of the command block.
    Command(CommandItem),
    /// Of the results of the last command.
    Result(ResultItem),
    /// Of the findings of the last scan.
    Found(FoundItem),
}

/// Of the gateway as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GatewayItem {
    /// "INCL".
    Magic,
    /// Version of the map.
    MapVersion,
    /// Number of slots.
    SlotCount,
    /// Address of the block of the first slot.
    SlotBase,
    /// Distance from one block to the next.
    SlotStride,
    /// Major and minor version of the firmware, one byte each.
    Version,
    /// Its patch number.
    Patch,
    /// Time since reset.
    Uptime,
    /// Status bits.
    Status,
    /// Counts the published states.
    Sequence,
    /// A number that is always the same.
    TestNumber,
    /// An angle that is always the same.
    TestAngle,
    /// A bit for every slot that gives a sign of life.
    Online,
    /// A bit for every slot whose angle is right and fresh.
    Valid,
    /// Slots that are switched on.
    Enabled,
    /// Of these, slots whose angle is right and fresh.
    Good,
    /// The oldest value of a slot that is switched on.
    OldestAge,
    /// A bit for every slot with an alarm.
    Alarms,
}

/// Of the value of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadingItem {
    /// Status code.
    Status,
    /// Angle in millidegrees.
    Angle,
    /// Angle in degrees.
    Degrees,
    /// Angle in hundredths of a degree, within half a turn.
    Centidegrees,
    /// Age in milliseconds.
    Age,
}

/// Of what else is known of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DetailItem {
    /// Flags.
    Flags,
    /// Temperature.
    Temperature,
    /// Counts the outcomes.
    Sequence,
    /// The angle as the sensor reports it.
    Raw,
    /// The angle with its turns.
    Unwrapped,
    /// Status of the last failure.
    LastError,
    /// Requests.
    Requests,
    /// Good answers to the first try.
    FirstTry,
    /// Repetitions.
    Retries,
    /// Requests without an answer.
    Timeouts,
    /// Wrong checksums.
    Checksum,
    /// Wrong lengths, addresses, commands.
    Length,
    /// Late answers.
    Late,
    /// Writes to non-volatile memory.
    Writes,
    /// Last response time.
    ResponseLast,
    /// Longest response time.
    ResponseMax,
    /// Kind of source.
    Kind,
    /// Address.
    Address,
    /// States of the alarms.
    Alarms,
    /// Since when one is raised.
    AlarmAge(Alarm),
    /// The value furthest beyond its limit.
    AlarmExtreme(Alarm),
    /// The lowest angle.
    Lowest,
    /// The highest angle.
    Highest,
    /// Since the lowest angle.
    LowestAge,
    /// Since the highest angle.
    HighestAge,
    /// Answers of others.
    Foreign,
    /// Readings that were not begun.
    Skipped,
    /// Misread characters.
    Garbled,
    /// Answers that refuse.
    Refused,
    /// Requests that were not sent.
    NotSent,
    /// Shortest response time.
    ResponseMin,
    /// Rate of change of the angle.
    Rate,
    /// Whole turns since the first value.
    Turns,
}

impl DetailItem {
    /// Whether it may be unavailable.
    pub(crate) const fn is_optional(self) -> bool {
        matches!(
            self,
            DetailItem::Temperature
                | DetailItem::Raw
                | DetailItem::Unwrapped
                | DetailItem::LastError
                | DetailItem::Rate
                | DetailItem::Turns
                | DetailItem::AlarmAge(_)
                | DetailItem::AlarmExtreme(_)
                | DetailItem::Lowest
                | DetailItem::Highest
                | DetailItem::LowestAge
                | DetailItem::HighestAge
        )
    }
}

/// Of what happened on a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusItem {
    /// Requests.
    Requests,
    /// Repetitions.
    Retries,
    /// Writes to non-volatile memory.
    Writes,
    /// Good answers.
    Good,
    /// Good answers to the first try.
    FirstTry,
    /// Nothing came back.
    NoAnswer,
    /// Something else came back.
    BadAnswer,
    /// Wrong checksums.
    Checksum,
    /// Wrong lengths.
    Length,
    /// Answers of others.
    Foreign,
    /// Late answers.
    Late,
    /// Driver switched off by force.
    Forced,
    /// The line did not fall silent.
    LineBusy,
    /// Another sender transmitted at the same time.
    Contention,
    /// Own characters that came back.
    Echo,
    /// Characters of no frame.
    Junk,
    /// Framing errors.
    Framing,
    /// Noise errors.
    Noise,
    /// Overruns.
    Overrun,
    /// Parity errors.
    Parity,
    /// Last response time.
    ResponseLast,
    /// Shortest response time.
    ResponseMin,
    /// Longest response time.
    ResponseMax,
    /// Longest driver release.
    ReleaseMax,
    /// Longest time the driver was on.
    HighMax,
    /// Characters before a request was out.
    Unasked,
    /// Characters of zeros with a low stop bit.
    Breaks,
    /// Why no node answers.
    Fault,
    /// How often the bus was declared faulty.
    Faults,
    /// Requests since the last answer.
    InVain,
}

/// Of how the gateway has started; see [`Start`](clino_recovery::Start) and [`Crash`](clino_recovery::Crash).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartItem {
    /// Cause of this start.
    Cause,
    /// Mode of this start.
    Mode,
    /// Source of time and bit rates.
    Clock,
    /// Power-ups.
    PowerUps,
    /// Starts.
    Boots,
    /// Crashes.
    Crashes,
    /// Cause of the last crash.
    CrashCause,
    /// Number of the start that crashed.
    CrashBoot,
    /// Time from that start to the crash.
    CrashUptime,
    /// The monitored task that did not check in, or the line of a panic.
    CrashDetail,
    /// The exception that was active.
    Exception,
    /// The instruction.
    Pc,
    /// The link register: its return address.
    Lr,
    /// The stack pointer.
    Sp,
    /// Fault status.
    Cfsr,
    /// HardFault status.
    Hfsr,
    /// Address of a fault.
    Address,
    /// Two characters of the name of a file.
    File,
    /// A word of the chip's number.
    Uid,
}

/// Of the command block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandItem {
    /// The command.
    Command,
    /// The slot or bus of the command.
    Target,
    /// Its value.
    Value,
    /// The arm key.
    Key,
    /// The last command accepted.
    Last,
    /// Its outcome.
    Outcome,
    /// Why it failed.
    Reason,
    /// Counts the accepted commands.
    Sequence,
    /// Steps done.
    Done,
    /// Steps in all.
    Of,
    /// Nodes that it silences.
    Silenced,
}

/// Of the results of the last command. Numbers from [`ResultItem::Writes`] to [`ResultItem::Sound`] are places in the
/// list of results, an array has one for each element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ResultItem {
    /// Writes to non-volatile memory.
    Writes,
    /// The sensor has to be repaired.
    Repair,
    /// How fast a sensor moved that was to be set to zero.
    Rate,
    /// Devices that a scan has found.
    Devices,
    /// Addresses at which a scan has heard something unintelligible.
    Suspects,
    /// Addresses that it has dealt with.
    Asked,
    /// It has left nothing out.
    Complete,
    /// Address of the sensor.
    Address,
    /// Address in its memory.
    Stored,
    /// Serial number.
    Serial,
    /// Product, four characters,
    Product,
    /// and two.
    Product2,
    /// Firmware, four characters,
    Firmware,
    /// and two.
    Firmware2,
    /// Damping of a T7.
    Damping,
    /// Output range of a T7.
    Range,
    /// Directions of its three axes.
    Direction,
    /// Offsets of its three axes.
    Offset = 19,
    /// Angle before.
    Before = 22,
    /// Angle afterwards.
    After,
    /// A setting before.
    From,
    /// A setting now.
    To,
    /// Angle of an ISU.
    Angle,
    /// Null position of an ISU.
    Null,
    /// Word of an ISU with the auto-shutoff bit.
    Shutoff,
    /// The checksum of its EEPROM is right.
    Sound,
    /// The command that all this is of, by its sequence number.
    Sequence,
    /// The scan that is in the window, by its sequence number.
    Scan,
    /// Devices and suspects that scan has found, whether all had room or not.
    Found,
}

/// Of something that the last scan has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoundItem {
    /// The scan, by its sequence number.
    Scan,
    /// Device or suspect.
    What,
    /// Its address.
    Address,
    /// Its bit rate.
    Baud,
    /// Its serial number.
    Serial,
    /// Its product, four characters,
    Product,
    /// and two.
    Product2,
    /// Its firmware, four characters,
    Firmware,
    /// and two.
    Firmware2,
}
