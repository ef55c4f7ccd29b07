//! The line driver while it is on.

use embedded_hal::digital::OutputPin;

/// The driver is on; dropping this value switches it off, also after an error.
pub(super) struct Driving<'a, DE: OutputPin> {
    de: &'a mut DE,
    on: bool,
}

impl<'a, DE: OutputPin> Driving<'a, DE> {
    pub(super) fn begin(de: &'a mut DE) -> Result<Self, DE::Error> {
        let driving = Self { de, on: true };
        driving.de.set_high()?;
        Ok(driving)
    }

    pub(super) fn end(mut self) -> Result<(), DE::Error> {
        self.de.set_low()?;
        self.on = false;
        Ok(())
    }
}

impl<DE: OutputPin> Drop for Driving<'_, DE> {
    fn drop(&mut self) {
        if self.on {
            // No caller is left to receive an error.
            let _ = self.de.set_low();
        }
    }
}
