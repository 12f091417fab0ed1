//! A damped oscillator with a wall: a whole model under the layer, small enough to read.
//!
//! ```text
//! cargo build --release -p fmi2-export --example oscillator
//! ```
//!
//! builds the binary that goes into the FMU's `binaries` folder; `Oscillator::table().to_xml()` is its
//! `modelDescription.xml`. Equation: `v' = gain u - 2 zeta omega v - omega² x`, `x' = v`, solved in
//! closed form for an input that changes linearly over the step.

use std::path::Path;
use std::sync::Arc;

use fmi2_export::description::{
    DefaultExperiment, Dependency, DependencyKind, Enumeration, Initial, LogCategory, ModelDescription, Unit, Variable,
};
use fmi2_export::{Experiment, LogEntry, Model, ModelError, Status, StepError, Value};

fmi2_export::export!(Oscillator);

/// Places in the table.
pub mod index {
    #![allow(missing_docs)]
    pub const TIME: usize = 0;
    pub const U: usize = 1;
    pub const X: usize = 2;
    pub const V: usize = 3;
    pub const DER_X: usize = 4;
    pub const DER_V: usize = 5;
    pub const ENERGY: usize = 6;
    pub const OMEGA: usize = 7;
    pub const ZETA: usize = 8;
    pub const GAIN: usize = 9;
    pub const WALL: usize = 10;
    pub const FAULT: usize = 11;
    pub const STEPS: usize = 12;
    pub const INSIDE: usize = 13;
    pub const HOLD: usize = 14;
    pub const LABEL: usize = 15;
    pub const REPORT: usize = 16;
    pub const DIMENSIONS: usize = 17;
}

/// The numbers of the state that a continuation needs.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Numbers {
    time: f64,
    u: f64,
    u_rate: f64,
    x: f64,
    v: f64,
    omega: f64,
    zeta: f64,
    gain: f64,
    wall: f64,
    fault: i32,
    steps: i32,
    hold: bool,
}

const START: Numbers = Numbers {
    time: 0.0,
    u: 0.0,
    u_rate: 0.0,
    x: 1.0,
    v: 0.0,
    omega: 2.0,
    zeta: 0.1,
    gain: 1.0,
    wall: 1e3,
    fault: 1,
    steps: 0,
    hold: false,
};

/// The model.
pub struct Oscillator {
    table: Arc<ModelDescription>,
    now: Numbers,
    label: String,
    log: Vec<LogEntry>,
}

impl Oscillator {
    /// The one table.
    #[must_use]
    pub fn table() -> ModelDescription {
        let mut table = ModelDescription::new("Damped oscillator", "Oscillator");
        table.description = Some("x'' + 2 zeta omega x' + omega² x = gain u, up to a wall".into());
        table.version = Some("1.0".into());
        table.units = vec![
            Unit::mechanical("m", 0, 1, 0, 0).display("mm", 1e3),
            Unit::mechanical("m/s", 0, 1, -1, 0),
            Unit::mechanical("m/s2", 0, 1, -2, 0),
            Unit::mechanical("rad/s", 0, 0, -1, 1),
            Unit::mechanical("s", 0, 0, 1, 0),
        ];
        table.enumerations = vec![Enumeration::new(
            "Fault",
            [
                ("none", "Steps are taken"),
                ("half", "A step stops half way"),
                ("panic", "A step panics"),
                ("warn", "A step is taken, with a warning"),
                ("tell", "A step is taken, with a word about it"),
            ],
        )];
        table.log_categories =
            vec![LogCategory { name: "logModel".into(), description: "What the oscillator has to say".into() }];
        table.default_experiment = Some(DefaultExperiment {
            start_time: Some(0.0),
            stop_time: Some(10.0),
            tolerance: None,
            step_size: Some(0.1),
        });
        for variable in variables() {
            table.add(variable);
        }
        table
    }

    /// Position and velocity a time `t` from now.
    fn solution(&self, t: f64) -> (f64, f64) {
        let Numbers { omega, zeta, .. } = self.now;
        // The particular solution a + b t, then the decaying rest.
        let b = self.now.gain * self.now.u_rate / (omega * omega);
        let a = (self.now.gain * self.now.u - 2.0 * zeta * omega * b) / (omega * omega);
        let decay = zeta * omega;
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let (x0, v0) = (self.now.x - a, self.now.v - b);
        let sine_part = (v0 + decay * x0) / damped;
        let (sin, cos) = (damped * t).sin_cos();
        let envelope = (-decay * t).exp();
        let x = envelope * (x0 * cos + sine_part * sin);
        let v = envelope * (v0 * cos - (decay * sine_part + damped * x0) * sin);
        (a + b * t + x, b + v)
    }

    fn acceleration(&self) -> f64 {
        let Numbers { omega, zeta, .. } = self.now;
        self.now.gain * self.now.u - 2.0 * zeta * omega * self.now.v - omega * omega * self.now.x
    }

    fn say(&mut self, status: Status, message: &str) {
        self.log.push(LogEntry { category: "logModel".into(), status, message: message.into() });
    }

    fn advance(&mut self, time: f64, step: f64) {
        if !self.now.hold {
            (self.now.x, self.now.v) = self.solution(step);
        }
        self.now.u += self.now.u_rate * step;
        self.now.time = time + step;
        self.now.steps += 1;
    }

    /// How long until the wall, if that is within `step`.
    fn until_wall(&self, step: f64) -> Option<f64> {
        let beyond = |t: f64| self.solution(t).0.abs() > self.now.wall;
        if self.now.hold || !beyond(step) {
            return None;
        }
        let (mut before, mut after) = (0.0, step);
        for _ in 0..60 {
            let middle = 0.5 * (before + after);
            if beyond(middle) {
                after = middle;
            } else {
                before = middle;
            }
        }
        Some(before)
    }
}

fn variables() -> Vec<Variable> {
    let any = |list: &[usize]| list.iter().map(|&i| Dependency::on(i)).collect::<Vec<_>>();
    let constant = |i| Dependency::of_kind(i, DependencyKind::Constant);
    let fixed = |i| Dependency::of_kind(i, DependencyKind::Fixed);
    let tunable = |i| Dependency::of_kind(i, DependencyKind::Tunable);
    vec![
        Variable::real("time", 0).independent().unit("s"),
        Variable::real("u", 1).input().unit("m/s2").start(START.u).described("Driving acceleration"),
        Variable::real("x", 2)
            .output()
            .initial(Initial::Exact)
            .unit("m")
            .display_unit("mm")
            .start(START.x)
            .depends_on([constant(index::X)])
            .described("Position"),
        Variable::real("v", 3)
            .output()
            .initial(Initial::Exact)
            .unit("m/s")
            .start(START.v)
            .depends_on([constant(index::V)])
            .described("Velocity"),
        Variable::real("der(x)", 4)
            .unit("m/s")
            .derivative_of_state(index::X)
            .depends_on([constant(index::V)])
            .initially_depends_on([constant(index::V)]),
        Variable::real("der(v)", 5)
            .unit("m/s2")
            .derivative_of_state(index::V)
            .depends_on([tunable(index::U), fixed(index::X), fixed(index::V)])
            .initially_depends_on(any(&[index::U, index::X, index::V, index::OMEGA, index::ZETA, index::GAIN])),
        Variable::real("energy", 6)
            .output()
            .depends_on(any(&[index::X, index::V]))
            .initially_depends_on(any(&[index::X, index::V, index::OMEGA]))
            .described("Energy per mass, m2/s2"),
        Variable::real("omega", 7)
            .parameter()
            .unit("rad/s")
            .min(1e-3)
            .start(START.omega)
            .described("Natural frequency"),
        Variable::real("zeta", 8).parameter().min(0.0).max(0.99).start(START.zeta).described("Damping ratio"),
        Variable::real("gain", 9).tunable_parameter().start(START.gain).described("Gain of the drive"),
        Variable::real("wall", 10)
            .parameter()
            .unit("m")
            .min(0.0)
            .start(START.wall)
            .described("|x| at which the simulation ends"),
        Variable::enumeration("fault", 0, "Fault")
            .tunable_parameter()
            .start_value(Value::Integer(START.fault))
            .described("How steps go wrong, to try out a host"),
        Variable::integer("steps", 1).output().depends_on([]).initially_depends_on([]).described("Steps taken"),
        Variable::boolean("inside", 0)
            .output()
            .depends_on(any(&[index::X]))
            .initially_depends_on(any(&[index::X, index::WALL]))
            .described("Is |x| below the wall?"),
        Variable::boolean("hold", 1)
            .input()
            .start_value(Value::Boolean(START.hold))
            .described("Stand still while true"),
        Variable::string("label", 0).parameter().start_value(Value::String("oscillator".into())).described("Any text"),
        Variable::string("report", 1).output().depends_on(any(&[index::X])).described("The position in words"),
        Variable::integer("dimensions", 2)
            .variability(fmi2_export::description::Variability::Constant)
            .start_value(Value::Integer(1)),
    ]
}

impl Model for Oscillator {
    const MODEL_IDENTIFIER: &'static str = "Oscillator";

    /// A file `start.txt` in the resources may hold the start position.
    fn instantiate(resources: Option<&Path>) -> Result<Self, ModelError> {
        let mut table = Self::table();
        let mut now = START;
        let file = resources.map(|folder| folder.join("start.txt"));
        if let Some(file) = file.filter(|file| file.exists()) {
            let text = std::fs::read_to_string(&file)
                .map_err(|error| ModelError::new(format!("{}: {error}", file.display())))?;
            now.x = text
                .trim()
                .parse()
                .map_err(|_| ModelError::new(format!("{}: expected a number, found `{text}`", file.display())))?;
            table.variables[index::X] = table.variables[index::X].clone().start(now.x);
        }
        Ok(Self { table: Arc::new(table), now, label: "oscillator".into(), log: Vec::new() })
    }

    fn description(&self) -> &Arc<ModelDescription> {
        &self.table
    }

    fn get(&mut self, index: usize) -> Result<Value, ModelError> {
        let now = &self.now;
        Ok(match index {
            index::U => Value::Real(now.u),
            index::X => Value::Real(now.x),
            index::V | index::DER_X => Value::Real(now.v),
            index::DER_V => Value::Real(self.acceleration()),
            index::ENERGY => Value::Real(0.5 * (now.v * now.v + (now.omega * now.x).powi(2))),
            index::OMEGA => Value::Real(now.omega),
            index::ZETA => Value::Real(now.zeta),
            index::GAIN => Value::Real(now.gain),
            index::WALL => Value::Real(now.wall),
            index::FAULT => Value::Integer(now.fault),
            index::STEPS => Value::Integer(now.steps),
            index::INSIDE => Value::Boolean(now.x.abs() < now.wall),
            index::HOLD => Value::Boolean(now.hold),
            index::LABEL => Value::String(self.label.clone()),
            index::REPORT => Value::String(format!("{} at {} m", self.label, now.x)),
            index::DIMENSIONS => Value::Integer(1),
            other => return Err(ModelError::new(format!("no variable {other}"))),
        })
    }

    fn set(&mut self, index: usize, value: Value) -> Result<(), ModelError> {
        let now = &mut self.now;
        match (index, value) {
            (index::U, Value::Real(v)) => (now.u, now.u_rate) = (v, 0.0),
            (index::X, Value::Real(v)) => now.x = v,
            (index::V, Value::Real(v)) => now.v = v,
            (index::OMEGA, Value::Real(v)) => now.omega = v,
            (index::ZETA, Value::Real(v)) => now.zeta = v,
            (index::GAIN, Value::Real(v)) => now.gain = v,
            (index::WALL, Value::Real(v)) => now.wall = v,
            (index::FAULT, Value::Integer(v)) => now.fault = v,
            (index::HOLD, Value::Boolean(v)) => now.hold = v,
            (index::LABEL, Value::String(v)) if v.is_empty() => {
                return Err(ModelError::new("a label cannot be empty"));
            }
            (index::LABEL, Value::String(v)) => self.label = v,
            (other, value) => {
                return Err(ModelError::new(format!("variable {other} cannot be {value:?}")));
            }
        }
        Ok(())
    }

    fn initialise(&mut self, experiment: Experiment) -> Result<(), ModelError> {
        if self.now.x.abs() > self.now.wall {
            return Err(ModelError::new(format!("x = {} starts beyond the wall at {}", self.now.x, self.now.wall)));
        }
        self.now.time = experiment.start_time;
        Ok(())
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), StepError> {
        match self.now.fault {
            2 => {
                self.advance(time, 0.5 * step);
                return Err(StepError {
                    reached: time + 0.5 * step,
                    message: "asked to stop half way, at 50% of the step".into(),
                    terminate: false,
                });
            }
            3 => panic!("asked to panic"),
            4 => self.say(Status::Warning, "asked to warn"),
            5 => self.say(Status::Ok, "asked to tell"),
            _ => {}
        }
        if let Some(until) = self.until_wall(step) {
            self.advance(time, until);
            return Err(StepError {
                reached: time + until,
                message: format!("the wall at {} m is reached", self.now.wall),
                terminate: true,
            });
        }
        self.advance(time, step);
        Ok(())
    }

    fn set_input_derivative(&mut self, index: usize, order: u32, value: f64) -> Result<(), ModelError> {
        if (index, order) != (index::U, 1) {
            return Err(ModelError::new(format!("no input derivative of order {order}")));
        }
        self.now.u_rate = value;
        Ok(())
    }

    fn output_derivative(&mut self, index: usize, _order: u32) -> Result<f64, ModelError> {
        let (now, acceleration) = (self.now, self.acceleration());
        match index {
            index::X => Ok(now.v),
            index::V => Ok(acceleration),
            index::ENERGY => Ok(now.v * (acceleration + now.omega * now.omega * now.x)),
            other => Err(ModelError::new(format!("no derivative of variable {other}"))),
        }
    }

    fn directional_derivative(
        &mut self,
        unknowns: &[usize],
        knowns: &[usize],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result<(), ModelError> {
        let now = self.now;
        let (mut dx, mut dv, mut d_acceleration, mut d_stiffness) = (0.0, 0.0, 0.0, 0.0);
        for (&known, &seed) in knowns.iter().zip(seed) {
            match known {
                index::TIME => {}
                index::U => d_acceleration += now.gain * seed,
                index::X => dx += seed,
                index::V => dv += seed,
                index::OMEGA => {
                    d_stiffness += 2.0 * now.omega * seed;
                    d_acceleration -= 2.0 * now.zeta * now.v * seed;
                }
                index::ZETA => d_acceleration -= 2.0 * now.omega * now.v * seed,
                index::GAIN => d_acceleration += now.u * seed,
                other => return Err(ModelError::new(format!("no derivative by {other}"))),
            }
        }
        let stiffness = now.omega * now.omega;
        d_acceleration -= 2.0 * now.zeta * now.omega * dv + stiffness * dx + d_stiffness * now.x;
        for (&unknown, out) in unknowns.iter().zip(out) {
            *out = match unknown {
                index::X => dx,
                index::V | index::DER_X => dv,
                index::DER_V => d_acceleration,
                index::ENERGY => now.v * dv + stiffness * now.x * dx + 0.5 * d_stiffness * now.x * now.x,
                other => return Err(ModelError::new(format!("no derivative of {other}"))),
            };
        }
        Ok(())
    }

    fn save(&self, out: &mut Vec<u8>) {
        let now = &self.now;
        for number in [now.time, now.u, now.u_rate, now.x, now.v, now.omega, now.zeta, now.gain, now.wall] {
            out.extend(number.to_le_bytes());
        }
        out.extend(now.fault.to_le_bytes());
        out.extend(now.steps.to_le_bytes());
        out.push(u8::from(now.hold));
        out.extend(self.label.as_bytes());
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), ModelError> {
        let wrong = || ModelError::new("not a saved oscillator");
        let (reals, rest) = bytes.split_at_checked(9 * 8).ok_or_else(wrong)?;
        let (integers, rest) = rest.split_at_checked(8).ok_or_else(wrong)?;
        let (hold, label) = rest.split_first().ok_or_else(wrong)?;
        let label = std::str::from_utf8(label).map_err(|_| wrong())?;
        let real = |i: usize| f64::from_le_bytes(std::array::from_fn(|k| reals[8 * i + k]));
        let integer = |i: usize| i32::from_le_bytes(std::array::from_fn(|k| integers[4 * i + k]));
        self.now = Numbers {
            time: real(0),
            u: real(1),
            u_rate: real(2),
            x: real(3),
            v: real(4),
            omega: real(5),
            zeta: real(6),
            gain: real(7),
            wall: real(8),
            fault: integer(0),
            steps: integer(1),
            hold: *hold != 0,
        };
        self.label = label.into();
        Ok(())
    }

    fn reset(&mut self) {
        let start = match self.table.variables[index::X].start_of() {
            Some(Value::Real(x)) => x,
            _ => START.x,
        };
        self.now = Numbers { x: start, ..START };
        self.label = "oscillator".into();
        self.log.clear();
    }

    fn take_log(&mut self) -> Vec<LogEntry> {
        std::mem::take(&mut self.log)
    }
}
