//! `clino serve`: the live page.

use std::future::IntoFuture as _;
use std::sync::Arc;

use tokio::net::TcpListener;

use crate::bridge::asked_to_end;
use crate::config::Config;
use crate::hub::Hub;
use crate::page::{self, Access, Memory};
use crate::say::say;
use crate::source::{ReadBus, Sources};

/// Runs until the program is asked to end. `listening` gets the address at which the page is.
///
/// # Errors
/// The address cannot be had, or would be open to others without a token.
pub async fn serve(config: Config, read_bus: ReadBus) -> Result<(), String> {
    let settings = &config.serve;
    let token = settings.token.as_ref().map(crate::config::Secret::read).transpose()?;
    let access = Access::new(settings.listen, settings.allow_writes, token)?;
    let listener =
        TcpListener::bind(settings.listen).await.map_err(|why| format!("{}: {why}", settings.listen))?;
    let address = listener.local_addr().map_err(|why| why.to_string())?;
    let hub = Arc::new(Hub::new(&config));
    let memory = Arc::new(Memory::new());
    let events = page::events(&hub, &memory);
    let sources = Sources::start(&config, &hub, &read_bus);
    let shared = Arc::new(page::Shared { hub, memory, access, sources, events });
    println!("http://{address}/");
    if shared.access.allows_writes() {
        say("writes are allowed: zero, scan, acknowledge");
    }
    // Browsers keep their event streams open: the program does not wait for them.
    tokio::select! {
        served = axum::serve(listener, page::router(shared)).into_future() => served.map_err(|why| why.to_string()),
        () = asked_to_end() => Ok(()),
    }
}
