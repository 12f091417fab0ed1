//! The gap once more, by an FMU driven through FMI: the search's own simulation has no part in it.

use cdpr::signal::indexed;
use cdpr_discovery::data::Channel;
use cdpr_discovery::outcome::Compared;

use super::importer::{Fmu, Slave};

/// Root mean square of (simulated - measured)/σ over a recording: the FMU starts at every restart from the state that
/// the search had there and runs free until the next. `states` holds that state: the search's own simulation
/// beginning at the restarts. `noise` holds σ of each channel.
pub(super) fn gap(fmu: &Fmu, compared: &Compared, states: &[Vec<f64>], noise: &[f64]) -> anyhow::Result<f64> {
    let trial = &compared.trial;
    let names: Vec<String> = trial.channels.iter().map(|c| c.name()).collect();
    let (mut sum, mut count) = (0.0, 0_usize);
    for (n, restart) in compared.restarts.iter().enumerate() {
        let end = compared.restarts.get(n + 1).copied().unwrap_or(trial.len());
        if end - restart < START_SAMPLES {
            continue;
        }
        let mut slave = fmu.instantiate("replay")?;
        begin(&mut slave, &trial.channels, &trial.time[*restart..end], &states[*restart..end])?;
        command(&mut slave, &trial.inputs[*restart].winch_force)?;
        slave.initialise()?;
        for k in *restart..end - 1 {
            command(&mut slave, &trial.inputs[k].winch_force)?;
            slave.step(trial.time[k] - trial.time[*restart], trial.time[k + 1] - trial.time[k])?;
            let shown = slave.get_reals(&names)?;
            for ((shown, measured), noise) in shown.iter().zip(&trial.measured[k + 1]).zip(noise) {
                let error = (shown - measured) / noise;
                if error.is_finite() {
                    sum += error * error;
                    count += 1;
                }
            }
        }
    }
    Ok((sum / count.max(1) as f64).sqrt())
}

/// Samples from which a state's rates are taken.
const START_SAMPLES: usize = 4;

/// Sets the start states: values as they stand, rates by differences of third order.
fn begin(slave: &mut Slave<'_>, channels: &[Channel], time: &[f64], rows: &[Vec<f64>]) -> anyhow::Result<()> {
    slave.set_choice("initialization", "from_states")?;
    let step = (time[START_SAMPLES - 1] - time[0]) / (START_SAMPLES - 1) as f64;
    for (j, channel) in channels.iter().enumerate() {
        let f = |k: usize| rows[k][j];
        let rate = (-11.0 * f(0) + 18.0 * f(1) - 9.0 * f(2) + 2.0 * f(3)) / (6.0 * step);
        let name = match *channel {
            Channel::Pose(k) => ["vx", "vy", "omega"][k].to_owned(),
            Channel::UnstretchedLength(i) => indexed("unstretched_length_rate", i),
            Channel::CableLength(_) | Channel::Tension(_) => continue,
        };
        slave.set_real(&channel.name(), f(0))?;
        slave.set_real(&name, rate)?;
    }
    Ok(())
}

fn command(slave: &mut Slave<'_>, forces: &[f64]) -> anyhow::Result<()> {
    forces.iter().enumerate().try_for_each(|(i, force)| slave.set_real(&indexed("winch_force", i), *force))
}
