//! TLS to the broker.

use std::fs;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

use rumqttc::tokio_rustls::rustls::{ClientConfig, RootCertStore};
use rumqttc::{TlsConfiguration, Transport};

/// TLS with the authority of this file, or with those of the system.
pub fn transport(ca_file: Option<&Path>) -> Result<Transport, String> {
    let mut roots = RootCertStore::empty();
    match ca_file {
        Some(path) => {
            let named = |why: &dyn std::fmt::Display| format!("{}: {why}", path.display());
            let file = fs::File::open(path).map_err(|why| named(&why))?;
            for certificate in certificates(&mut BufReader::new(file)).map_err(|why| named(&why))? {
                roots.add(certificate).map_err(|why| named(&why))?;
            }
            if roots.is_empty() {
                return Err(named(&"no certificate in it, expected PEM"));
            }
        }
        None => {
            for certificate in rustls_native_certs::load_native_certs().certs {
                // One that rustls does not take is one that it would not trust.
                let _ = roots.add(certificate);
            }
            if roots.is_empty() {
                return Err("this system has no certificates: set `ca_file`".into());
            }
        }
    }
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(|why| why.to_string())?
        .with_root_certificates(roots)
        .with_no_client_auth();
    Ok(Transport::tls_with_config(TlsConfiguration::Rustls(Arc::new(config))))
}

fn certificates(
    from: &mut dyn std::io::BufRead,
) -> Result<Vec<rustls::pki_types::CertificateDer<'static>>, String> {
    use rustls::pki_types::pem::PemObject as _;
    let mut text = Vec::new();
    from.read_to_end(&mut text).map_err(|why| why.to_string())?;
    rustls::pki_types::CertificateDer::pem_slice_iter(&text)
        .collect::<Result<_, _>>()
        .map_err(|why| why.to_string())
}
