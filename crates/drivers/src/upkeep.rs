//! What blocking and async drivers of both protocols have in common: everything that does not wait.

/// The methods of a driver with the fields `port` and `exchanges`. A macro, so that each of the four drivers has them as
/// its own, where its documentation is read.
macro_rules! upkeep {
    ($driver:ident) => {
        impl<P> $driver<P> {
            /// What happened on the line since this was made.
            pub fn counters(&self) -> &BusCounters {
                self.exchanges.master().counters()
            }

            /// The waits in force.
            pub fn timing(&self) -> &Timing {
                self.exchanges.master().timing()
            }

            /// Other waits from the next exchange on, say for another bit rate; the port has to follow.
            pub fn set_timing(&mut self, timing: Timing) {
                self.exchanges.set_timing(timing);
            }

            /// How often to repeat a request that failed, from the next one on; never, unless this says otherwise. What
            /// changes a sensor's non-volatile memory is only repeated if the sensor cannot have heard it.
            pub fn set_retry(&mut self, retry: Retry) {
                self.exchanges.set_retry(retry);
            }

            /// Says that so much time has passed since the last call. The driver has no clock, and counts only what it
            /// waits itself; after a failure, the same request is not sent again while a late answer could be taken for
            /// its own ([`Timing::late`]), and this shortens that. To say too little is safe, to say too much is not.
            pub fn pass(&mut self, span: Duration) {
                self.exchanges.pass(span);
            }

            /// The port.
            pub fn port(&mut self) -> &mut P {
                &mut self.port
            }

            /// The port, without the driver.
            pub fn release(self) -> P {
                self.port
            }
        }

        impl<P> core::fmt::Debug for $driver<P> {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.debug_struct(stringify!($driver))
                    .field("timing", self.timing())
                    .field("counters", self.counters())
                    .finish_non_exhaustive()
            }
        }
    };
}

pub(crate) use upkeep;
