//! TLS: who is trusted as a server, and what a server of ours shows.

use std::sync::Arc;

use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ClientConfig, RootCertStore, ServerConfig};

/// TLS that trusts the authorities in the text of a PEM file only, or those that the system trusts. An error says what
/// is wrong with them.
pub fn client(trusted: Option<&[u8]>) -> Result<Arc<ClientConfig>, String> {
    let mut authorities = RootCertStore::empty();
    if let Some(pem) = trusted {
        for certificate in CertificateDer::pem_slice_iter(pem) {
            let certificate = certificate.map_err(|error| format!("a trusted certificate cannot be read: {error}"))?;
            authorities.add(certificate).map_err(|error| format!("a trusted certificate cannot be used: {error}"))?;
        }
        if authorities.is_empty() {
            return Err("the file of trusted certificates has none".to_owned());
        }
    } else {
        authorities.add_parsable_certificates(rustls_native_certs::load_native_certs().certs);
        if authorities.is_empty() {
            return Err("this system trusts no authority; name a file of certificates with `trust`".to_owned());
        }
    }
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(|error| error.to_string())?;
    Ok(Arc::new(config.with_root_certificates(authorities).with_no_client_auth()))
}

/// TLS that shows these certificates, with this key: both are texts of PEM files. An error says what is wrong.
pub fn server(certificates: &[u8], key: &[u8]) -> Result<Arc<ServerConfig>, String> {
    let chain: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(certificates).collect();
    let chain = chain.map_err(|error| format!("the certificate cannot be read: {error}"))?;
    let key = PrivateKeyDer::from_pem_slice(key).map_err(|error| format!("the key cannot be read: {error}"))?;
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ServerConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(|error| error.to_string())?
        .with_no_client_auth()
        .with_single_cert(chain, key)
        .map_err(|error| format!("the certificate and the key cannot be used: {error}"))?;
    Ok(Arc::new(config))
}
