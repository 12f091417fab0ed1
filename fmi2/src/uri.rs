//! The resource location, in all the forms that masters send.

use std::path::PathBuf;

/// Why a resource location gives no folder.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum LocationError {
    /// Nothing unusual: an FMU need not have a `resources` folder, and hosts name it all the same.
    #[error("resource location `{0}`: no such folder")]
    Missing(String),
    #[error("resource location `{location}`: expected a `file:` location, found `{scheme}:`")]
    Scheme { location: String, scheme: String },
    #[error("resource location `{location}` is on another host, `{host}`")]
    Host { location: String, host: String },
}

/// The folder that `fmuResourceLocation` names.
///
/// Taken as found in masters: `file:/p`, `file:///p`, `file:////p`, `file://localhost/p`, Windows
/// drives behind any of these, percent-encoded UTF-8 or raw text, with or without a trailing slash,
/// and plain paths.
///
/// # Errors
/// Why the location cannot be used: another scheme, another host, or no such folder.
pub(crate) fn resource_folder(location: &str) -> Result<PathBuf, LocationError> {
    let raw = local_part(location)?;
    // A master that does not encode may send a `%41` that is meant as it stands.
    let candidates = if raw.len() == location.len() {
        vec![PathBuf::from(raw)]
    } else {
        vec![PathBuf::from(percent_decoded(&raw)), PathBuf::from(&raw)]
    };
    candidates.into_iter().find(|path| path.is_dir()).ok_or_else(|| LocationError::Missing(location.to_owned()))
}

/// The path in a location: scheme and host taken off, still percent-encoded.
fn local_part(location: &str) -> Result<String, LocationError> {
    let Some(rest) = strip_scheme(location)? else {
        return Ok(location.to_owned());
    };
    let path = match rest.strip_prefix("//") {
        None => rest.to_owned(),
        Some(after) => {
            let end = after.find('/').unwrap_or(after.len());
            let (host, path) = after.split_at(end);
            if host.is_empty() || host.eq_ignore_ascii_case("localhost") {
                path.to_owned()
            } else if is_drive(host) {
                // `file://C:/p`, where a slash was forgotten.
                after.to_owned()
            } else if cfg!(windows) {
                format!("//{host}{path}")
            } else {
                return Err(LocationError::Host { location: location.to_owned(), host: host.to_owned() });
            }
        }
    };
    Ok(without_extra_slashes(&path))
}

/// What follows `file:`; `None` for a plain path.
fn strip_scheme(location: &str) -> Result<Option<&str>, LocationError> {
    let Some((scheme, rest)) = location.split_once(':') else {
        return Ok(None);
    };
    let is_scheme = scheme.len() > 1 && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
    if scheme.eq_ignore_ascii_case("file") {
        Ok(Some(rest))
    } else if is_scheme && rest.starts_with("//") {
        Err(LocationError::Scheme { location: location.to_owned(), scheme: scheme.to_owned() })
    } else {
        Ok(None)
    }
}

/// `//p` becomes `/p`, and `/C:/p` becomes `C:/p`; on Windows `//server/share` stays.
fn without_extra_slashes(path: &str) -> String {
    let bare = path.trim_start_matches('/');
    if bare.split('/').next().is_some_and(is_drive) {
        return bare.replacen('|', ":", 1);
    }
    match path.len() - bare.len() {
        0 => bare.to_owned(),
        2 if cfg!(windows) => path.to_owned(),
        _ => format!("/{bare}"),
    }
}

/// `C:`, or `C|` as some old writers have it.
fn is_drive(text: &str) -> bool {
    matches!(text.as_bytes(), [letter, b':' | b'|'] if letter.is_ascii_alphabetic())
}

/// `%20` and its like replaced; what is no such code, or not UTF-8 in the end, stays as it is.
fn percent_decoded(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let code = (bytes[at] == b'%')
            .then(|| bytes.get(at + 1..at + 3))
            .flatten()
            .and_then(|pair| Some(hex_digit(pair[0])? << 4 | hex_digit(pair[1])?));
        out.push(code.unwrap_or(bytes[at]));
        at += if code.is_some() { 3 } else { 1 };
    }
    String::from_utf8(out).unwrap_or_else(|_| text.to_owned())
}

fn hex_digit(byte: u8) -> Option<u8> {
    char::from(byte).to_digit(16).map(|digit| digit as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_parts() {
        for (location, expected) in [
            ("file:/a/b", "/a/b"),
            ("file:///a/b", "/a/b"),
            ("file:////a/b/", if cfg!(windows) { "//a/b/" } else { "/a/b/" }),
            ("FILE:///a/b", "/a/b"),
            ("file://localhost/a/b", "/a/b"),
            ("file:///C:/a/b", "C:/a/b"),
            ("file:///C|/a/b", "C:/a/b"),
            ("file:/C:/a/b", "C:/a/b"),
            ("file://C:/a/b", "C:/a/b"),
            ("file:C:/a/b", "C:/a/b"),
            ("/a/b:c/", "/a/b:c/"),
            ("C:\\a\\b", "C:\\a\\b"),
            ("C:/a/b", "C:/a/b"),
            ("relative/b", "relative/b"),
        ] {
            assert_eq!(local_part(location).as_deref(), Ok(expected), "{location}");
        }
    }

    #[test]
    fn foreign_locations_are_named() {
        let problem = local_part("https://a.example/resources").unwrap_err().to_string();
        assert!(problem.contains("`https:`"), "{problem}");
        if !cfg!(windows) {
            let problem = local_part("file://server/share").unwrap_err().to_string();
            assert!(problem.contains("`server`"), "{problem}");
        }
    }

    #[test]
    fn percent_codes() {
        assert_eq!(percent_decoded("/a%20b/%C3%BC%e2%82%AC"), "/a b/ü€");
        assert_eq!(percent_decoded("/100%/%zz/%4"), "/100%/%zz/%4");
        assert_eq!(percent_decoded("/%ff"), "/%ff");
    }
}
