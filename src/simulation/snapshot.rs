//! Saving a simulation as bytes and taking it up again, bit for bit.

use super::Simulation;
use super::command::Stretch;
use super::system::{InputSegment, PlantSystem};
use crate::dynamics::Inputs;
use crate::integrator::{Choice, Contraction, Memory};
use crate::per_cable::PerCable;

/// Bytes that are no snapshot of this plant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the saved state is not of this plant: {0}")]
pub struct SnapshotError(&'static str);

fn put(out: &mut Vec<u8>, values: &[f64]) {
    for value in values {
        out.extend_from_slice(&value.to_le_bytes());
    }
}

fn put_inputs(out: &mut Vec<u8>, inputs: &Inputs) {
    put(out, &inputs.winch_force);
    put(out, &inputs.disturbance);
}

fn put_flags(out: &mut Vec<u8>, flags: &PerCable<bool>) {
    out.extend(flags.map(u8::from));
}

fn put_choice(out: &mut Vec<u8>, choice: &Choice) {
    let Choice { explicit, trial, steps, calls, cost, time, rival, wait, pause } = *choice;
    out.extend([explicit, trial].map(u8::from));
    put(out, &[steps, calls, wait, pause].map(f64::from));
    put(out, &[cost, time]);
    put(out, &rival);
}

/// Room for what is read before it is believed.
#[derive(Clone, Debug, Default)]
pub(super) struct Room {
    y: Vec<f64>,
    stretches: Vec<Stretch>,
    points: Vec<(f64, [f64; 6])>,
    memory: Memory,
}

/// Whether it is a count.
fn is_whole(count: &f64) -> bool {
    count.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(count)
}

/// What is left to read, of a plant with so many cables.
struct Reader<'a>(&'a [u8], usize);

impl Reader<'_> {
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], SnapshotError> {
        let (head, tail) = self.0.split_first_chunk::<N>().ok_or(SnapshotError("it ends too early"))?;
        self.0 = tail;
        Ok(*head)
    }

    /// A number; everything kept is finite.
    fn number(&mut self) -> Result<f64, SnapshotError> {
        let value = f64::from_le_bytes(self.bytes()?);
        if value.is_finite() { Ok(value) } else { Err(SnapshotError("a number is not finite")) }
    }

    fn count(&mut self, size: usize) -> Result<usize, SnapshotError> {
        let count = usize::try_from(u64::from_le_bytes(self.bytes()?));
        let count = count.map_err(|_| SnapshotError("a count is too large"))?;
        if count.saturating_mul(size) > self.0.len() {
            return Err(SnapshotError("a count is too large"));
        }
        Ok(count)
    }

    fn numbers<const N: usize>(&mut self) -> Result<[f64; N], SnapshotError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.number()?;
        }
        Ok(values)
    }

    fn per_cable(&mut self) -> Result<PerCable<f64>, SnapshotError> {
        let mut values = PerCable::filled(self.1, 0.0);
        for value in &mut values {
            *value = self.number()?;
        }
        Ok(values)
    }

    /// `count` numbers into `list`, in place of what is there.
    fn list(&mut self, count: usize, list: &mut Vec<f64>) -> Result<(), SnapshotError> {
        list.clear();
        for _ in 0..count {
            list.push(self.number()?);
        }
        Ok(())
    }

    fn inputs(&mut self) -> Result<Inputs, SnapshotError> {
        Ok(Inputs { winch_force: self.per_cable()?, disturbance: self.numbers()? })
    }

    fn flag(&mut self) -> Result<bool, SnapshotError> {
        match self.bytes()? {
            [0] => Ok(false),
            [1] => Ok(true),
            _ => Err(SnapshotError("a flag is neither 0 nor 1")),
        }
    }

    fn flags(&mut self) -> Result<PerCable<bool>, SnapshotError> {
        let mut flags = PerCable::filled(self.1, false);
        for flag in &mut flags {
            *flag = self.flag()?;
        }
        Ok(flags)
    }

    fn choice(&mut self) -> Result<Choice, SnapshotError> {
        let (explicit, trial) = (self.flag()?, self.flag()?);
        let counts: [f64; 4] = self.numbers()?;
        let ([cost, time], rival) = (self.numbers()?, self.numbers()?);
        let [steps, calls, wait, pause] = counts.map(|count| count as u32);
        let choice = Choice { explicit, trial, steps, calls, cost, time, rival, wait, pause };
        if counts.iter().all(is_whole) && choice.is_possible() {
            Ok(choice)
        } else {
            Err(SnapshotError("its integrator is in no possible state"))
        }
    }
}

impl Simulation {
    /// Appends everything that a bit-identical continuation needs.
    pub fn save(&self, out: &mut Vec<u8>) {
        let count = |n: usize| (n as u64).to_le_bytes();
        out.extend(self.plant.fingerprint().to_le_bytes());
        out.extend(count(self.y.len()));
        put(out, &[self.time, self.time_carry]);
        put(out, &self.y);
        put_flags(out, &self.slack);
        put_inputs(out, &self.inputs);
        put_inputs(out, &self.input_slopes);
        put(out, &[self.input_time]);
        put(out, &self.winch_disturbance);
        out.extend(count(self.commands.stretches.len()));
        for stretch in &self.commands.stretches {
            put(out, &[stretch.start]);
            put(out, &stretch.value);
            put(out, &stretch.slope);
        }
        out.extend(count(self.poses.points.len()));
        for (time, point) in &self.poses.points {
            put(out, &[*time]);
            put(out, point);
        }
        let memory = self.integrator.memory();
        put(out, &[memory.next_step, memory.factored_step, memory.jacobian_time]);
        put(out, &[memory.last.0, memory.last.1]);
        out.extend(count(memory.jacobian_state.len()));
        put(out, &memory.jacobian_state);
        put(out, &[memory.jacobian_least, memory.jacobian_excess].map(f64::from));
        out.extend(count(memory.trend.len()));
        put(out, &memory.trend);
        put(out, &[memory.settling, memory.contraction.rate]);
        put(out, &memory.contraction.first);
        out.extend(count(memory.rates.len()));
        put(out, &memory.rates);
        out.extend(count(memory.stiff_since.iter().len()));
        put(out, memory.stiff_since.as_slice());
        put_choice(out, &memory.choice);
        put_inputs(out, &self.work.linearised_inputs);
        put_flags(out, &self.work.linearised_slack);
    }

    /// Takes up a saved state of the same plant; unchanged on error. After the first time nothing is allocated.
    ///
    /// # Errors
    /// When the bytes are not a saved state of this plant.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        let mut room = std::mem::take(&mut self.room);
        let result = self.take_up(bytes, &mut room);
        self.room = room;
        result
    }

    fn take_up(&mut self, bytes: &[u8], room: &mut Room) -> Result<(), SnapshotError> {
        let Room { y, stretches, points, memory } = room;
        let cables = self.plant.cables();
        let mut reader = Reader(bytes, cables);
        if reader.bytes()? != self.plant.fingerprint().to_le_bytes() {
            return Err(SnapshotError("it was saved from another model"));
        }
        let n = reader.count(8)?;
        if n != self.y.len() {
            return Err(SnapshotError("it has another number of states"));
        }
        let [time, time_carry] = reader.numbers()?;
        reader.list(n, y)?;
        let slack = reader.flags()?;
        let inputs = reader.inputs()?;
        let input_slopes = reader.inputs()?;
        let input_time = reader.number()?;
        let winch_disturbance = reader.per_cable()?;
        stretches.clear();
        for _ in 0..reader.count(8 * (1 + 2 * cables))? {
            stretches.push(Stretch { start: reader.number()?, value: reader.per_cable()?, slope: reader.per_cable()? });
        }
        points.clear();
        for _ in 0..reader.count(56)? {
            points.push((reader.number()?, reader.numbers::<6>()?));
        }
        let [next_step, factored_step, jacobian_time] = reader.numbers()?;
        let [last_step, last_error] = reader.numbers()?;
        let jacobian_count = reader.count(8)?;
        reader.list(jacobian_count, &mut memory.jacobian_state)?;
        let jacobian_use: [f64; 2] = reader.numbers()?;
        let trend_count = reader.count(8)?;
        reader.list(trend_count, &mut memory.trend)?;
        memory.settling = reader.number()?;
        let [rate, correction, defect] = reader.numbers()?;
        memory.contraction = Contraction { rate, first: [correction, defect] };
        let rates_count = reader.count(8)?;
        reader.list(rates_count, &mut memory.rates)?;
        let stiff_since = match reader.count(8)? {
            0 => None,
            1 => Some(reader.number()?),
            _ => return Err(SnapshotError("it is stiff from several times on")),
        };
        let choice = reader.choice()?;
        let linearised_inputs = reader.inputs()?;
        let mut linearised_slack = reader.flags()?;
        if !reader.0.is_empty() {
            return Err(SnapshotError("it is too long"));
        }
        if stretches.is_empty() || stretches.windows(2).any(|s| s[0].start > s[1].start) {
            return Err(SnapshotError("its commands are not in order"));
        }
        if points.is_empty() == self.poses.active() || points.windows(2).any(|p| p[0].0 > p[1].0) {
            return Err(SnapshotError("its poses are not in order"));
        }
        let past = |time_then: Option<f64>| time_then.is_none_or(|then| then <= time);
        let newest = [Some(input_time), stiff_since, stretches.last().map(|s| s.start), points.last().map(|p| p.0)];
        if !newest.into_iter().all(past) || time_carry.abs() > f64::EPSILON * time.abs() {
            return Err(SnapshotError("its times are not in order"));
        }
        if self.plant.wound_in(y) || jacobian_count > 0 && self.plant.wound_in(&memory.jacobian_state) {
            return Err(SnapshotError("an unstretched length is not positive"));
        }
        let sizes = [next_step, factored_step, last_step, last_error, memory.settling, rate, correction, defect];
        if ![0, n].contains(&jacobian_count)
            || ![0, 6 * n].contains(&trend_count)
            || ![0, n].contains(&rates_count)
            || sizes.iter().any(|size| *size < 0.0)
            || !jacobian_use.iter().all(is_whole)
        {
            return Err(SnapshotError("its integrator is in no possible state"));
        }
        self.time = time;
        self.time_carry = time_carry;
        self.y.copy_from_slice(y);
        self.slack = slack;
        self.inputs = inputs;
        self.input_slopes = input_slopes;
        self.held = input_slopes.is_zero();
        self.input_time = input_time;
        self.winch_disturbance = winch_disturbance;
        self.commands.stretches.clear();
        self.commands.stretches.extend(&*stretches);
        self.poses.points.clear();
        self.poses.points.extend(&*points);
        (memory.next_step, memory.factored_step, memory.jacobian_time) = (next_step, factored_step, jacobian_time);
        [memory.jacobian_least, memory.jacobian_excess] = jacobian_use.map(|count| count as u32);
        (memory.last, memory.stiff_since, memory.choice) = ((last_step, last_error), stiff_since, choice);
        self.work.linearised_inputs = linearised_inputs;
        self.work.linearised_slack = linearised_slack;
        let segment = InputSegment::new(jacobian_time, linearised_inputs, Inputs::none(cables));
        let plant = self.plant.at(jacobian_time);
        let mut system = PlantSystem::new(plant, &segment, &mut linearised_slack, &mut self.work);
        self.integrator.restore(memory, &mut system);
        Ok(())
    }
}
