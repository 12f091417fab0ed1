//! Formulas over the states, inputs and time: reading them and evaluating them.
//!
//! Grammar: numbers, variables, `+ - * / ^`, parentheses, and the functions `sin cos tan tanh exp log sqrt abs sign`
//! of one argument. `^` takes a number as its exponent. Variables: `x y phi vx vy omega time`, `disturbance_force_x`,
//! `disturbance_force_y`, `disturbance_torque`, and with the number of a cable `winch_force[i]`, `cable_length[i]`,
//! `cable_speed[i]`, `unstretched_length[i]`, `unstretched_length_rate[i]`. SI units, radians.
//!
//! `sign(a)` is `tanh(a / 1e-6)`, see [`SIGN_WIDTH`].

use std::ops::Range;

use crate::per_cable::MAX_CABLES;
use crate::scalar::{Real, tanh};
use crate::signal::{DISTURBANCES, Signal, indexed};
use crate::winch::WinchCommand;

/// What a formula is made of, in a few words.
pub const GRAMMAR: &str = "numbers, + - * / ^ (to a number), parentheses, functions sin cos tan tanh exp log sqrt abs \
    sign (as tanh(a/1e-6)), variables x y phi vx vy omega time disturbance_force_x disturbance_force_y disturbance_torque, and of cable i \
    winch_force[i] cable_length[i] cable_speed[i] unstretched_length[i] unstretched_length_rate[i] (i = 1 to n); SI \
    units, radians";

/// Where `sign(a)` turns: it is `tanh(a / SIGN_WIDTH)`, in the unit of its argument. `sign(a / 1000)` turns more gently.
///
/// A jump would have no solution where both sides of it push back towards it, which is what dry friction at rest does. Smooth,
/// `-500*sign(vx)` holds the platform against up to 500 N at a creep below some 1e-6 m/s, 4 mm an hour.
pub const SIGN_WIDTH: f64 = 1e-6;

/// A variable of a formula; indices count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// Time (s).
    Time,
    /// `x`, `y` (m), `phi` (rad).
    Pose(usize),
    /// `vx`, `vy` (m/s), `omega` (rad/s).
    Twist(usize),
    /// Winch force as commanded (N).
    WinchForce(usize),
    /// Disturbance force x, y (N), torque (N m).
    Disturbance(usize),
    /// Geometric cable length (m).
    CableLength(usize),
    /// Rate of the geometric cable length (m/s).
    CableSpeed(usize),
    /// Unstretched length (m).
    UnstretchedLength(usize),
    /// Rate of the unstretched length (m/s).
    UnstretchedRate(usize),
}

impl Variable {
    fn read(name: &str, index: Option<usize>) -> Option<Self> {
        const OF_AXIS: [fn(usize) -> Variable; 3] = [Variable::Pose, Variable::Twist, Variable::Disturbance];
        const OF_CABLE: [fn(usize) -> Variable; 5] = [
            Variable::WinchForce,
            Variable::CableLength,
            Variable::CableSpeed,
            Variable::UnstretchedLength,
            Variable::UnstretchedRate,
        ];
        let named = |variable: &Self| variable.facts().0 == name;
        match index {
            None => {
                let of_platform = OF_AXIS.into_iter().flat_map(|of| (0..3).map(of));
                std::iter::once(Self::Time).chain(of_platform).find(named)
            }
            Some(i) => OF_CABLE.into_iter().map(|of| of(i)).find(named),
        }
    }

    /// Its name without the cable's number, and its unit as FMI writes it.
    fn facts(self) -> (&'static str, &'static str) {
        let of = |signal: Signal| (signal.facts().name, signal.unit());
        match self {
            Self::Time => ("time", "s"),
            Self::Pose(k) => of(Signal::Pose(k)),
            Self::Twist(k) => of(Signal::Twist(k)),
            Self::WinchForce(_) => (WinchCommand::Force.input(), WinchCommand::Force.unit()),
            Self::Disturbance(k) => (DISTURBANCES[k].name, DISTURBANCES[k].unit),
            Self::CableLength(i) => of(Signal::CableLength(i)),
            Self::CableSpeed(_) => ("cable_speed", "m/s"),
            Self::UnstretchedLength(i) => of(Signal::UnstretchedLength(i)),
            Self::UnstretchedRate(i) => of(Signal::UnstretchedRate(i)),
        }
    }

    /// Its name in a formula.
    pub fn name(self) -> String {
        let (name, _) = self.facts();
        match self {
            Self::Time | Self::Pose(_) | Self::Twist(_) | Self::Disturbance(_) => name.to_owned(),
            Self::WinchForce(i)
            | Self::CableLength(i)
            | Self::CableSpeed(i)
            | Self::UnstretchedLength(i)
            | Self::UnstretchedRate(i) => indexed(name, i),
        }
    }

    /// Its unit as FMI writes it.
    pub fn unit(self) -> &'static str {
        self.facts().1
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Function {
    Sin,
    Cos,
    Tan,
    Tanh,
    Exp,
    Log,
    Sqrt,
    Abs,
    Sign,
}

const FUNCTIONS: [(&str, Function); 9] = [
    ("sin", Function::Sin),
    ("cos", Function::Cos),
    ("tan", Function::Tan),
    ("tanh", Function::Tanh),
    ("exp", Function::Exp),
    ("log", Function::Log),
    ("sqrt", Function::Sqrt),
    ("abs", Function::Abs),
    ("sign", Function::Sign),
];

/// One step of the stack machine a formula is compiled to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Op {
    Number(f64),
    Variable(Variable),
    Add,
    Subtract,
    Multiply,
    Divide,
    Power(f64),
    Negate,
    Call(Function),
}

/// Deepest stack of intermediate values.
const DEPTH: usize = 32;
/// Deepest nesting of parentheses and signs, so that no text exhausts the reader's stack.
const NESTING: usize = 64;

/// A formula ready for evaluation.
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    ops: Vec<Op>,
}

/// A text that is no formula.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("at character {position}: {message}")]
pub struct FormulaError {
    /// Character position, from 1.
    pub position: usize,
    /// What was found and what was expected.
    pub message: String,
}

/// A number in the text of a formula, exponents not among them.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// Its value, without a sign that stands before it.
    pub value: f64,
    /// The characters it is made of.
    pub characters: Range<usize>,
}

/// The numbers in the text of a formula, in the order in which they stand there.
///
/// # Errors
/// As [`Formula::parse`].
pub fn numbers(text: &str) -> Result<Vec<Number>, FormulaError> {
    let chars: Vec<char> = text.chars().collect();
    Ok(Reader::read(&chars)?.numbers)
}

impl Formula {
    /// Reads a formula.
    ///
    /// # Errors
    /// Says at which character, what was found and what was expected.
    pub fn parse(text: &str) -> Result<Self, FormulaError> {
        let chars: Vec<char> = text.chars().collect();
        let ops = Reader::read(&chars)?.ops;
        let (mut depth, mut deepest) = (0usize, 0usize);
        for op in &ops {
            match op {
                Op::Number(_) | Op::Variable(_) => depth += 1,
                Op::Add | Op::Subtract | Op::Multiply | Op::Divide => depth -= 1,
                Op::Power(_) | Op::Negate | Op::Call(_) => {}
            }
            deepest = deepest.max(depth);
        }
        if deepest > DEPTH {
            return Err(FormulaError {
                position: 1,
                message: format!("needs {deepest} intermediate values, at most {DEPTH} are kept"),
            });
        }
        Ok(Self { ops })
    }

    /// Whether it contains a variable of which `is` holds.
    pub fn uses(&self, is: impl Fn(Variable) -> bool) -> bool {
        self.ops.iter().any(|op| matches!(op, Op::Variable(v) if is(*v)))
    }

    /// The variables it contains, each once, in the order in which they first stand in it.
    pub fn variables(&self) -> Vec<Variable> {
        let mut list = Vec::new();
        for op in &self.ops {
            if let Op::Variable(variable) = op
                && !list.contains(variable)
            {
                list.push(*variable);
            }
        }
        list
    }

    /// The last cable (from 0) that a variable belongs to, if any does.
    pub fn last_cable(&self) -> Option<usize> {
        let cable = |op: &Op| match op {
            Op::Variable(
                Variable::WinchForce(i)
                | Variable::CableLength(i)
                | Variable::CableSpeed(i)
                | Variable::UnstretchedLength(i)
                | Variable::UnstretchedRate(i),
            ) => Some(*i),
            _ => None,
        };
        self.ops.iter().filter_map(cable).max()
    }

    /// The value, with `variable` giving the value of each variable.
    pub fn value<S: Real>(&self, variable: impl Fn(Variable) -> S) -> S {
        let mut stack = [S::from(0.0); DEPTH];
        let mut top = 0;
        for op in &self.ops {
            match *op {
                Op::Number(value) => {
                    stack[top] = S::from(value);
                    top += 1;
                }
                Op::Variable(v) => {
                    stack[top] = variable(v);
                    top += 1;
                }
                Op::Add | Op::Subtract | Op::Multiply | Op::Divide => {
                    let (a, b) = (stack[top - 2], stack[top - 1]);
                    top -= 1;
                    stack[top - 1] = match op {
                        Op::Add => a + b,
                        Op::Subtract => a - b,
                        Op::Multiply => a * b,
                        _ => a / b,
                    };
                }
                Op::Power(exponent) => stack[top - 1] = power(stack[top - 1], exponent),
                Op::Negate => stack[top - 1] = -stack[top - 1],
                Op::Call(function) => {
                    let a = stack[top - 1];
                    stack[top - 1] = match function {
                        Function::Sin => a.sin(),
                        Function::Cos => a.cos(),
                        Function::Tan => a.tan(),
                        Function::Tanh => tanh(a),
                        Function::Exp => a.exp(),
                        Function::Log => a.ln(),
                        // Dual numbers have no finite derivative of the root of a constant zero.
                        Function::Sqrt => {
                            if a.re() == 0.0 {
                                S::from(0.0)
                            } else {
                                a.sqrt()
                            }
                        }
                        Function::Abs => a.abs(),
                        Function::Sign => tanh(a / SIGN_WIDTH),
                    };
                }
            }
        }
        stack[0]
    }
}

fn power<S: Real>(base: S, exponent: f64) -> S {
    if exponent.fract() == 0.0 && exponent.abs() < 64.0 { base.powi(exponent as i32) } else { base.powf(exponent) }
}

struct Reader<'a> {
    chars: &'a [char],
    position: usize,
    nesting: usize,
    ops: Vec<Op>,
    numbers: Vec<Number>,
}

impl<'a> Reader<'a> {
    /// Reads a whole text.
    fn read(chars: &'a [char]) -> Result<Self, FormulaError> {
        let mut reader = Reader { chars, position: 0, nesting: 0, ops: Vec::new(), numbers: Vec::new() };
        reader.sum()?;
        reader.skip_space();
        if reader.position < chars.len() {
            return Err(reader.unexpected("an operator or the end"));
        }
        Ok(reader)
    }

    fn skip_space(&mut self) {
        while self.chars.get(self.position).is_some_and(|c| c.is_whitespace()) {
            self.position += 1;
        }
    }

    fn peek(&mut self) -> Option<char> {
        self.skip_space();
        self.chars.get(self.position).copied()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        self.position += usize::from(found);
        found
    }

    fn error(&self, position: usize, message: String) -> FormulaError {
        FormulaError { position: position + 1, message }
    }

    fn unexpected(&mut self, expected: &str) -> FormulaError {
        let found = self.peek().map_or("the end".to_owned(), |c| format!("'{c}'"));
        self.error(self.position, format!("found {found}, expected {expected}"))
    }

    fn sum(&mut self) -> Result<(), FormulaError> {
        self.product()?;
        loop {
            let op = if self.take('+') {
                Op::Add
            } else if self.take('-') {
                Op::Subtract
            } else {
                return Ok(());
            };
            self.product()?;
            self.ops.push(op);
        }
    }

    fn product(&mut self) -> Result<(), FormulaError> {
        self.signed()?;
        loop {
            let op = if self.take('*') {
                Op::Multiply
            } else if self.take('/') {
                Op::Divide
            } else {
                return Ok(());
            };
            self.signed()?;
            self.ops.push(op);
        }
    }

    fn signed(&mut self) -> Result<(), FormulaError> {
        self.nesting += 1;
        if self.nesting > NESTING {
            return Err(self.error(self.position, format!("nested deeper than {NESTING} levels")));
        }
        if self.take('-') {
            self.signed()?;
            self.ops.push(Op::Negate);
        } else {
            self.take('+');
            self.atom()?;
            if self.take('^') {
                let negative = self.take('-');
                let exponent = self.number()?;
                self.ops.push(Op::Power(if negative { -exponent } else { exponent }));
            }
        }
        self.nesting -= 1;
        Ok(())
    }

    fn atom(&mut self) -> Result<(), FormulaError> {
        match self.peek() {
            Some('(') => {
                self.position += 1;
                self.sum()?;
                if self.take(')') { Ok(()) } else { Err(self.unexpected("')'")) }
            }
            Some(c) if c.is_ascii_digit() || c == '.' => {
                let start = self.position;
                let value = self.number()?;
                self.ops.push(Op::Number(value));
                self.numbers.push(Number { value, characters: start..self.position });
                Ok(())
            }
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.name(),
            _ => Err(self.unexpected("a number, a variable, a function or '('")),
        }
    }

    fn number(&mut self) -> Result<f64, FormulaError> {
        self.skip_space();
        let start = self.position;
        let mut text = String::new();
        while let Some(&c) = self.chars.get(self.position) {
            let exponent_sign = (c == '+' || c == '-') && text.ends_with(['e', 'E']);
            if !(c.is_ascii_digit() || c == '.' || ((c == 'e' || c == 'E') && !text.is_empty()) || exponent_sign) {
                break;
            }
            text.push(c);
            self.position += 1;
        }
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ if text.is_empty() => Err(self.unexpected("a number")),
            _ => Err(self.error(start, format!("found '{text}', expected a finite number"))),
        }
    }

    fn name(&mut self) -> Result<(), FormulaError> {
        let start = self.position;
        let mut name = String::new();
        while let Some(&c) = self.chars.get(self.position) {
            if !(c.is_ascii_alphanumeric() || c == '_') {
                break;
            }
            name.push(c);
            self.position += 1;
        }
        if self.take('(') {
            let Some((_, function)) = FUNCTIONS.iter().find(|(known, _)| *known == name) else {
                let known: Vec<&str> = FUNCTIONS.iter().map(|(n, _)| *n).collect();
                return Err(self.error(start, format!("no function '{name}', expected one of {}", known.join(", "))));
            };
            self.sum()?;
            if !self.take(')') {
                return Err(self.unexpected("')'"));
            }
            self.ops.push(Op::Call(*function));
            return Ok(());
        }
        let index = if self.take('[') {
            let position = self.position;
            let value = self.number()?;
            if !self.take(']') {
                return Err(self.unexpected("']'"));
            }
            if value.fract() != 0.0 || !(1.0..=MAX_CABLES as f64).contains(&value) {
                return Err(self.error(position, format!("index {value}, expected 1 to {MAX_CABLES}")));
            }
            Some(value as usize - 1)
        } else {
            None
        };
        match Variable::read(&name, index) {
            Some(variable) => {
                self.ops.push(Op::Variable(variable));
                Ok(())
            }
            None => {
                let shown = index.map_or(name.clone(), |i| format!("{name}[{}]", i + 1));
                Err(self.error(
                    start,
                    format!(
                        "no variable '{shown}', expected x, y, phi, vx, vy, omega, time, disturbance_force_x, \
                         disturbance_force_y, disturbance_torque, winch_force[i], cable_length[i], cable_speed[i], \
                         unstretched_length[i] or unstretched_length_rate[i]"
                    ),
                ))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> f64 {
        Formula::parse(text).unwrap().value(|v| match v {
            Variable::Pose(0) => 2.0,
            Variable::Pose(1) => -3.0,
            Variable::WinchForce(3) => 7.0,
            _ => 0.5,
        })
    }

    #[test]
    fn follows_the_usual_precedence() {
        assert_eq!(value("1+2*3"), 7.0);
        assert_eq!(value("-2^2"), -4.0);
        assert_eq!(value("2^-1"), 0.5);
        assert_eq!(value("8/2/2"), 2.0);
        assert_eq!(value("-34.8*x*abs(y)"), -34.8 * 2.0 * 3.0);
        assert_eq!(value("winch_force[4] - (1e1 - 5E-1)"), -2.5);
        assert_eq!(value("sign(y) + tanh(0)"), -1.0);
    }

    #[test]
    fn numbers_of_a_text_are_its_coefficients_and_no_exponents() {
        let text = "-3.5e1*x^2 + 9E2 * sin( 2.5*cable_length[4] - .25)";
        let found = numbers(text).unwrap();
        let said: Vec<&str> = found.iter().map(|n| &text[n.characters.clone()]).collect();
        assert_eq!(said, ["3.5e1", "9E2", "2.5", ".25"]);
        assert_eq!(found.iter().map(|n| n.value).collect::<Vec<_>>(), [35.0, 900.0, 2.5, 0.25]);
        assert_eq!(Formula::parse(text).unwrap().variables(), [Variable::Pose(0), Variable::CableLength(3)]);
    }

    #[test]
    fn the_grammar_in_words_is_the_grammar() {
        let after = |word: &str| GRAMMAR.split_once(word).unwrap().1;
        let list = |text: &'static str| text.split([',', '(']).next().unwrap().split_whitespace();
        let functions: Vec<&str> = list(after("functions ")).collect();
        assert_eq!(functions, FUNCTIONS.map(|(name, _)| name));
        let names = list(after("variables ")).chain(list(after("of cable i ")));
        let read: Vec<Variable> = names
            .map(|name| match name.strip_suffix("[i]") {
                Some(name) => Variable::read(name, Some(0)),
                None => Variable::read(name, None),
            })
            .collect::<Option<_>>()
            .unwrap();
        assert_eq!(read.len(), 15);
    }

    #[test]
    fn says_where_a_text_is_wrong() {
        for (text, position, part) in [
            ("", 1, "the end"),
            ("1 +", 4, "the end"),
            ("2 * z", 5, "no variable 'z'"),
            ("winch_force[13]", 13, "index 13"),
            ("foo(1)", 1, "no function 'foo'"),
            ("(1", 3, "')'"),
            ("1e999", 1, "finite"),
            ("x 2", 3, "an operator"),
        ] {
            let error = Formula::parse(text).unwrap_err();
            assert_eq!(error.position, position, "{text}: {error}");
            assert!(error.message.contains(part), "{text}: {error}");
        }
        assert!(Formula::parse(&"(".repeat(100_000)).is_err());
    }
}
