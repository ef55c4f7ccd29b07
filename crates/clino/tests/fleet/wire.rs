//! A wire to the broker that can be cut and mended.

use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;

/// A port of loopback that leads to another one.
pub struct Wire {
    port: u16,
    is_cut: Arc<AtomicBool>,
    streams: Arc<Mutex<Vec<TcpStream>>>,
}

impl Wire {
    /// A wire to this port, whole.
    pub fn to(port: u16) -> Wire {
        let listener = TcpListener::bind(("127.0.0.1", 0)).expect("loopback");
        let here = listener.local_addr().expect("it is bound").port();
        let wire = Wire { port: here, is_cut: Arc::default(), streams: Arc::default() };
        let (is_cut, streams) = (wire.is_cut.clone(), wire.streams.clone());
        thread::spawn(move || {
            for near in listener.incoming().map_while(Result::ok) {
                let far = TcpStream::connect(("127.0.0.1", port));
                let mut streams = streams.lock().expect("no panic");
                let (false, Ok(far)) = (is_cut.load(Ordering::Relaxed), far) else { continue };
                for (from, to) in [(&near, &far), (&far, &near)] {
                    let copy = |stream: &TcpStream| stream.try_clone().expect("a stream");
                    let (from, to) = (copy(from), copy(to));
                    streams.push(copy(&from));
                    thread::spawn(move || pass(from, to));
                }
            }
        });
        wire
    }

    pub fn port(&self) -> u16 {
        self.port
    }

    /// Ends all connections: what is on its way is lost. No new one is let through.
    pub fn cut(&self) {
        self.is_cut.store(true, Ordering::Relaxed);
        for stream in self.streams.lock().expect("no panic").drain(..) {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// Lets connections through again.
    pub fn mend(&self) {
        self.is_cut.store(false, Ordering::Relaxed);
    }
}

fn pass(mut from: TcpStream, mut to: TcpStream) {
    let mut buffer = [0; 4_096];
    while let Ok(count @ 1..) = from.read(&mut buffer) {
        if to.write_all(&buffer[..count]).is_err() {
            break;
        }
    }
    let _ = to.shutdown(Shutdown::Both);
}
