//! Tables that a user hands in: long ones, broken ones, and what is none.

mod real;

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use real::{HEADER, fails};

/// A table of this many rows, whose last one ends in a cell that is no number.
fn long(header: &str, rows: u32, cells: &str) -> String {
    let mut text = format!("{header}\n");
    for k in 1..rows {
        let _ = writeln!(text, "{},{cells},1", f64::from(k) * 0.01);
    }
    let _ = writeln!(text, "{},{cells},end", f64::from(rows) * 0.01);
    text
}

#[test]
fn reading_takes_time_in_proportion_to_the_rows() {
    const ROWS: u32 = 300_000;
    let begun = Instant::now();
    let forces = long(HEADER, ROWS, "1,1,1");
    let line = format!("line {}: `winch_force[4]` is \"end\"", ROWS + 1);
    fails(&[("in.csv", &forces)], &["simulate", "--input", "in.csv", "-o", "out.csv"], 2, &[&line]);
    let motion = long("time,x,y,phi", ROWS, "0,0");
    let line = format!("line {}: `phi` is \"end\"", ROWS + 1);
    fails(&[("t.csv", &motion)], &["inverse", "--trajectory", "t.csv", "-o", "f.csv"], 2, &[&line]);
    // Counting the lines anew for each row took a quarter of an hour.
    assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
}

#[test]
fn long_cells_do_not_fill_the_screen() {
    let body = format!("{HEADER}\n0,1,{},1,1\n", "9x".repeat(100_000));
    let said = fails(&[("in.csv", &body)], &["simulate", "--input", "in.csv", "-o", "o.csv"], 2, &["line 2", "..."]);
    assert!(said.len() < 300, "{said}");
}

#[test]
fn formulas_are_not_taken_for_numbers() {
    let body = format!("{HEADER}\n0,1,=1+2,1,1\n");
    let words = ["in.csv: line 2: `winch_force[2]` is \"=1+2\", a formula; expected its value, a finite number"];
    fails(&[("in.csv", &body)], &["simulate", "--input", "in.csv", "-o", "out.csv"], 2, &words);
}

#[cfg(unix)]
#[test]
fn devices_without_an_end_are_refused() {
    let byte = ["/dev/zero: line 1: found the byte 0x00"];
    fails(&[], &["simulate", "--input", "/dev/zero", "-o", "out.csv"], 2, &byte);
    fails(&[], &["inverse", "--trajectory", "/dev/zero", "-o", "out.csv"], 2, &byte);
    fails(&[], &["discover", "--data", "/dev/zero", "--out", "found"], 2, &byte);
    fails(&[], &["simulate", "--model", "/dev/zero", "-o", "out.csv"], 2, &["/dev/zero", "expected a model file"]);
}
