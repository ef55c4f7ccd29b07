//! Status codes of slots. The numbers are part of the map: they never change their meaning.

/// What a slot's value is worth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Status {
    /// Nothing was read since reset.
    NeverRead = 0,
    /// The angle is right and fresh.
    Ok = 1,
    /// The last angle was right, but it is too old.
    Stale = 2,
    /// The node did not answer in time.
    NoAnswer = 3,
    /// Something came back that is not a valid answer.
    BadAnswer = 4,
    /// The node answered that it cannot.
    DeviceError = 5,
    /// The angle is outside its documented range.
    OutOfRange = 6,
    /// Our own request did not get out.
    NotSent = 7,
    /// A PWM input without a signal.
    NoSignal = 8,
    /// The PWM input sits at a low level.
    StuckLow = 9,
    /// The PWM input sits at a high level.
    StuckHigh = 10,
    /// The PWM period is not that of an ISU.
    BadPeriod = 11,
    /// Two values in a row disagree; neither is told.
    Suspect = 12,
    /// The slot is switched off, or there is none.
    #[default]
    Disabled = 13,
    /// The slot cannot be read as it is set.
    ConfigFault = 14,
}

impl Status {
    /// The codes with names and meanings, for the documentation.
    pub const ALL: [(Status, &str, &str); 15] = [
        (
            Status::NeverRead,
            "never_read",
            "nothing was read since reset, or since the slot or its sensor was set up anew",
        ),
        (Status::Ok, "ok", "the angle is right and fresh"),
        (Status::Stale, "stale", "the last angle was right, but it is too old"),
        (Status::NoAnswer, "no_answer", "the node did not answer in time"),
        (Status::BadAnswer, "bad_answer", "something came back that is not a valid answer"),
        (Status::DeviceError, "device_error", "the node answered that it cannot"),
        (Status::OutOfRange, "out_of_range", "the angle is outside its documented range"),
        (Status::NotSent, "not_sent", "the gateway's own request did not get out"),
        (Status::NoSignal, "no_signal", "a PWM input without a signal"),
        (Status::StuckLow, "stuck_low", "the PWM input sits at a low level"),
        (Status::StuckHigh, "stuck_high", "the PWM input sits at a high level"),
        (Status::BadPeriod, "bad_period", "the PWM period is not that of an ISU"),
        (Status::Suspect, "suspect", "two values in a row disagree; neither is told"),
        (Status::Disabled, "disabled", "the slot is switched off, or there is none"),
        (Status::ConfigFault, "config_fault", "the slot cannot be read as it is set"),
    ];
}
