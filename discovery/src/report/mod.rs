//! The report: one self-contained HTML file for a person with two minutes.
//!
//! [`Report`] says what was found; [`render`] makes the page out of it, [`gap_picture`] one static picture. Nothing
//! here reads or writes files, and the page loads nothing from anywhere: styles, scripts, drawings and numbers are in
//! it. Layout in `assets/report.html`, `report.css` and `report.js`.

mod axis;
mod check;
mod data;
mod formula;
mod gather;
mod grammar;
mod heat;
mod limit;
mod number;
mod page;
mod picture;
mod place;
mod robot;
mod signature;
mod stability;
mod together;
mod words;

pub use check::{ReportError, check};
pub use data::*;
pub use formula::{printed, term};
pub use gather::gather;
pub(crate) use grammar::join;
pub use limit::{not_excited, would_show};
pub use number::{gap as gap_text, quantity, significant};
pub(crate) use number::{plain, with_error};
pub use page::render;
pub use picture::{gap_picture, most_telling};
pub(crate) use place::channel_words;
pub use words::{Summary, control_runs, phrase, summary};

#[cfg(test)]
mod tests;

/// `text` as content or attribute value of HTML and SVG.
fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c => safe.push(c),
        }
    }
    safe
}
