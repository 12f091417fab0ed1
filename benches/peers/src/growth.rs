//! What a step costs with more instances and in longer trials.

use std::fmt::Write as _;

use crate::fmu::{Instance, guid};
use crate::race::{quartiles, thread_time};

/// Steps in a row of one instance, where it has the processor's caches for itself.
const IN_A_ROW: usize = 20;

/// Instances that step in turn, against the same ones that take [`IN_A_ROW`] steps each.
fn instances(rounds: usize, text: &mut String) {
    let guid = guid();
    *text += "### Many instances\n\n| instances | ns a step in turn | over 20 steps in a row each | quartiles |\n| --- | --- | --- | --- |\n";
    for count in [1, 10, 100, 1000] {
        let mut all: Vec<Instance> = (0..count).map(|_| Instance::new(&guid)).collect();
        // Past the first, careful steps.
        all.iter_mut().for_each(|one| (0..50).for_each(|_| one.set_and_step()));
        let turns = (2000 / count).max(1);
        let steps = (turns * count * IN_A_ROW) as f64;
        let (mut ratios, mut costs) = (Vec::new(), Vec::new());
        for _ in 0..rounds {
            let begun = thread_time();
            for _ in 0..turns {
                all.iter_mut().for_each(|one| (0..IN_A_ROW).for_each(|_| one.set_and_step()));
            }
            let row = thread_time() - begun;
            let begun = thread_time();
            for _ in 0..turns * IN_A_ROW {
                all.iter_mut().for_each(Instance::set_and_step);
            }
            let turn = thread_time() - begun;
            ratios.push(turn / row);
            costs.push(turn / steps);
        }
        let ([low, median, high], cost) = (quartiles(ratios), quartiles(costs)[1]);
        let _ = writeln!(text, "| {count} | {:.0} | {median:.2} | {low:.2} to {high:.2} |", 1e9 * cost);
    }
    text.push('\n');
}

/// The later steps of a trial against its first ones.
fn trial(text: &mut String) {
    let mut one = Instance::new(&guid());
    *text += "### Long trials\n\n| steps of 10 ms | ns a step |\n| --- | --- |\n";
    let mut done = 0_usize;
    for length in [1_000_usize, 10_000, 100_000, 300_000] {
        let begun = thread_time();
        (done..length).for_each(|_| one.set_and_step());
        let cost = (thread_time() - begun) / (length - done) as f64;
        let _ = writeln!(text, "| {done} to {length} | {:.0} |", 1e9 * cost);
        done = length;
    }
    text.push('\n');
}

pub(crate) fn report(rounds: usize) -> String {
    let mut text = String::new();
    instances(rounds, &mut text);
    trial(&mut text);
    text
}
