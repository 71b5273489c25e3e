//! Executes WGSL functions on the processor, one invocation at a time: what shows that shaders compute the right
//! numbers where there is no GPU.
//!
//! It walks naga's intermediate representation of a parsed module. It knows what the shaders of this crate use:
//! numbers of 32 bits, vectors, arrays, structures, local variables, calls, branches, loops and a few functions.
//! It panics at everything else, so that nothing is passed over. Single-precision operations round as those of
//! Rust do; a GPU may be a little worse.

use std::rc::Rc;

use naga::{
    ArraySize, BinaryOperator, Block, Expression, Function, Handle, Literal, MathFunction, Module, RelationalFunction,
    ScalarKind, Statement, Type, TypeInner, UnaryOperator,
};

/// More rounds than any loop of the shaders has.
const MOST_ROUNDS: u32 = 100_000;

/// A value of the shading language.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    /// `f32`.
    F32(f32),
    /// `i32`.
    I32(i32),
    /// `u32`.
    U32(u32),
    /// `bool`.
    Bool(bool),
    /// The components of a vector, the elements of an array, the members of a structure.
    Many(Rc<Vec<Value>>),
}

impl Value {
    /// A vector, array or structure.
    pub(crate) fn many(values: Vec<Value>) -> Self {
        Self::Many(Rc::new(values))
    }

    /// The number, where it is one of single precision.
    #[track_caller]
    pub(crate) fn f32(&self) -> f32 {
        match self {
            Self::F32(x) => *x,
            other => panic!("{other:?} is no f32"),
        }
    }

    /// Components, elements or members.
    #[track_caller]
    pub(crate) fn parts(&self) -> &[Value] {
        match self {
            Self::Many(values) => values,
            other => panic!("{other:?} has no parts"),
        }
    }

    #[track_caller]
    fn bool(&self) -> bool {
        match self {
            Self::Bool(x) => *x,
            other => panic!("{other:?} is no condition"),
        }
    }

    /// As an index.
    #[track_caller]
    fn index(&self) -> usize {
        match self {
            Self::I32(x) => usize::try_from(*x).expect("an index is not negative"),
            Self::U32(x) => *x as usize,
            other => panic!("{other:?} is no index"),
        }
    }
}

/// Where control goes after a statement.
enum Flow {
    Next,
    Break,
    Continue,
    Return(Option<Value>),
}

/// A function that is running.
struct Frame<'a> {
    function: &'a Function,
    /// Which of its expressions are places, not values.
    places: &'a [bool],
    arguments: &'a [Value],
    /// Of the expressions that have been evaluated.
    values: Vec<Option<Value>>,
    locals: Vec<Value>,
}

/// A module that can be executed.
pub(crate) struct Machine<'a> {
    module: &'a Module,
    constants: Vec<Value>,
    places: Vec<Vec<bool>>,
}

impl<'a> Machine<'a> {
    /// Prepares a module that has been validated.
    pub(crate) fn new(module: &'a Module) -> Self {
        let mut machine = Self { module, constants: Vec::new(), places: Vec::new() };
        for (_, constant) in module.constants.iter() {
            // Constants may refer to earlier ones alone.
            let value = machine.global(constant.init);
            machine.constants.push(value);
        }
        for (_, function) in module.functions.iter() {
            let mut places: Vec<bool> = Vec::with_capacity(function.expressions.len());
            for (_, expression) in function.expressions.iter() {
                places.push(match expression {
                    Expression::LocalVariable(_) => true,
                    Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => places[base.index()],
                    _ => false,
                });
            }
            machine.places.push(places);
        }
        machine
    }

    /// The function of this name.
    fn find(&self, name: &str) -> Handle<Function> {
        let found = self.module.functions.iter().find(|(_, function)| function.name.as_deref() == Some(name));
        found.unwrap_or_else(|| panic!("the shader has no function {name}")).0
    }

    /// Calls a function.
    pub(crate) fn call(&self, name: &str, arguments: &[Value]) -> Value {
        self.run(self.find(name), arguments).unwrap_or_else(|| panic!("{name} returns nothing"))
    }

    /// An argument of a function from bytes in the layout of the shading language.
    pub(crate) fn argument_from_bytes(&self, name: &str, argument: usize, bytes: &[u8]) -> Value {
        self.decode(self.module.functions[self.find(name)].arguments[argument].ty, bytes)
    }

    fn decode(&self, ty: Handle<Type>, bytes: &[u8]) -> Value {
        match &self.module.types[ty].inner {
            TypeInner::Scalar(scalar) => scalar_from_bytes(scalar.kind, bytes),
            TypeInner::Vector { size, scalar } => {
                let components = 0..*size as usize;
                Value::many(components.map(|i| scalar_from_bytes(scalar.kind, &bytes[4 * i..])).collect())
            }
            TypeInner::Array { base, size: ArraySize::Constant(count), stride } => {
                let elements = 0..count.get() as usize;
                Value::many(elements.map(|i| self.decode(*base, &bytes[*stride as usize * i..])).collect())
            }
            TypeInner::Struct { members, .. } => {
                let members = members.iter();
                Value::many(members.map(|member| self.decode(member.ty, &bytes[member.offset as usize..])).collect())
            }
            other => panic!("no bytes make a {other:?}"),
        }
    }

    fn zero(&self, ty: Handle<Type>) -> Value {
        match &self.module.types[ty].inner {
            TypeInner::Scalar(scalar) => zero_scalar(scalar.kind),
            TypeInner::Vector { size, scalar } => Value::many(vec![zero_scalar(scalar.kind); *size as usize]),
            TypeInner::Array { base, size: ArraySize::Constant(count), .. } => {
                Value::many(vec![self.zero(*base); count.get() as usize])
            }
            TypeInner::Struct { members, .. } => {
                Value::many(members.iter().map(|member| self.zero(member.ty)).collect())
            }
            other => panic!("no zero of {other:?}"),
        }
    }

    /// An expression outside all functions.
    fn global(&self, handle: Handle<Expression>) -> Value {
        self.fixed(&self.module.global_expressions[handle], &|handle| self.global(handle))
    }

    /// An expression that needs no execution, in terms of others.
    fn fixed(&self, expression: &Expression, value: &dyn Fn(Handle<Expression>) -> Value) -> Value {
        match expression {
            Expression::Literal(literal) => match *literal {
                Literal::F32(x) => Value::F32(x),
                Literal::I32(x) => Value::I32(x),
                Literal::U32(x) => Value::U32(x),
                Literal::Bool(x) => Value::Bool(x),
                other => panic!("the interpreter does not know {other:?}"),
            },
            Expression::Constant(constant) => self.constants[constant.index()].clone(),
            Expression::ZeroValue(ty) => self.zero(*ty),
            Expression::Splat { size, value: scalar } => Value::many(vec![value(*scalar); *size as usize]),
            Expression::Compose { ty, components } => {
                let components = components.iter().map(|component| value(*component));
                if matches!(self.module.types[*ty].inner, TypeInner::Vector { .. }) {
                    // A vector may be made of shorter ones.
                    let mut flat = Vec::new();
                    for component in components {
                        match component {
                            Value::Many(parts) => flat.extend(parts.iter().cloned()),
                            scalar => flat.push(scalar),
                        }
                    }
                    Value::many(flat)
                } else {
                    Value::many(components.collect())
                }
            }
            other => panic!("the interpreter does not know {other:?} here"),
        }
    }

    fn run(&self, handle: Handle<Function>, arguments: &[Value]) -> Option<Value> {
        let function = &self.module.functions[handle];
        assert_eq!(function.arguments.len(), arguments.len(), "arguments of {:?}", function.name);
        let mut frame = Frame {
            function,
            places: &self.places[handle.index()],
            arguments,
            values: vec![None; function.expressions.len()],
            locals: Vec::with_capacity(function.local_variables.len()),
        };
        for (_, local) in function.local_variables.iter() {
            let value = match local.init {
                Some(init) => self.value(&frame, init),
                None => self.zero(local.ty),
            };
            frame.locals.push(value);
        }
        match self.block(&mut frame, &function.body) {
            Flow::Return(value) => value,
            _ => None,
        }
    }

    fn block(&self, frame: &mut Frame<'_>, block: &Block) -> Flow {
        for statement in block.iter() {
            let flow = self.statement(frame, statement);
            if !matches!(flow, Flow::Next) {
                return flow;
            }
        }
        Flow::Next
    }

    fn statement(&self, frame: &mut Frame<'_>, statement: &Statement) -> Flow {
        match statement {
            Statement::Emit(range) => {
                for handle in range.clone() {
                    if !frame.places[handle.index()] {
                        frame.values[handle.index()] = Some(self.evaluate(frame, handle));
                    }
                }
                Flow::Next
            }
            Statement::Block(block) => self.block(frame, block),
            Statement::If { condition, accept, reject } => {
                let chosen = if self.value(frame, *condition).bool() { accept } else { reject };
                self.block(frame, chosen)
            }
            Statement::Loop { body, continuing, break_if } => {
                for _ in 0..MOST_ROUNDS {
                    match self.block(frame, body) {
                        Flow::Break => return Flow::Next,
                        Flow::Return(value) => return Flow::Return(value),
                        Flow::Next | Flow::Continue => {}
                    }
                    self.block(frame, continuing);
                    if break_if.is_some_and(|condition| self.value(frame, condition).bool()) {
                        return Flow::Next;
                    }
                }
                panic!("a loop in {:?} does not end", frame.function.name)
            }
            Statement::Break => Flow::Break,
            Statement::Continue => Flow::Continue,
            Statement::Return { value } => Flow::Return(value.map(|handle| self.value(frame, handle))),
            Statement::Store { pointer, value } => {
                let value = self.value(frame, *value);
                let (local, path) = self.place(frame, *pointer);
                let mut slot = &mut frame.locals[local];
                for &i in &path {
                    let Value::Many(parts) = slot else { panic!("a store into a part of what has none") };
                    slot = &mut Rc::make_mut(parts)[i];
                }
                *slot = value;
                Flow::Next
            }
            Statement::Call { function, arguments, result } => {
                let arguments: Vec<Value> = arguments.iter().map(|handle| self.value(frame, *handle)).collect();
                let value = self.run(*function, &arguments);
                if let Some(result) = result {
                    frame.values[result.index()] = value;
                }
                Flow::Next
            }
            other => panic!("the interpreter does not know {other:?}"),
        }
    }

    /// A local variable, and the way to a part of it.
    fn place(&self, frame: &Frame<'_>, handle: Handle<Expression>) -> (usize, Vec<usize>) {
        match &frame.function.expressions[handle] {
            Expression::LocalVariable(local) => (local.index(), Vec::new()),
            Expression::AccessIndex { base, index } => {
                let (local, mut path) = self.place(frame, *base);
                path.push(*index as usize);
                (local, path)
            }
            Expression::Access { base, index } => {
                let (local, mut path) = self.place(frame, *base);
                path.push(self.value(frame, *index).index());
                (local, path)
            }
            other => panic!("{other:?} is no place"),
        }
    }

    /// The value of an expression that has been evaluated, or needs no evaluation.
    fn value(&self, frame: &Frame<'_>, handle: Handle<Expression>) -> Value {
        if let Some(value) = &frame.values[handle.index()] {
            return value.clone();
        }
        match &frame.function.expressions[handle] {
            Expression::FunctionArgument(i) => frame.arguments[*i as usize].clone(),
            // Before the first statement: initial values of variables.
            fixed => self.fixed(fixed, &|handle| self.value(frame, handle)),
        }
    }

    fn evaluate(&self, frame: &Frame<'_>, handle: Handle<Expression>) -> Value {
        let value = |handle: Handle<Expression>| self.value(frame, handle);
        match &frame.function.expressions[handle] {
            Expression::Access { base, index } => value(*base).parts()[value(*index).index()].clone(),
            Expression::AccessIndex { base, index } => value(*base).parts()[*index as usize].clone(),
            Expression::Swizzle { size, vector, pattern } => {
                let vector = value(*vector);
                let chosen = pattern[..*size as usize].iter();
                Value::many(chosen.map(|component| vector.parts()[*component as usize].clone()).collect())
            }
            Expression::Load { pointer } => {
                let (local, path) = self.place(frame, *pointer);
                let mut slot = &frame.locals[local];
                for i in path {
                    slot = &slot.parts()[i];
                }
                slot.clone()
            }
            Expression::Unary { op, expr } => map(&value(*expr), &|x| unary(*op, x)),
            Expression::Binary { op, left, right } => zip(&value(*left), &value(*right), &|a, b| binary(*op, a, b)),
            Expression::Select { condition, accept, reject } => {
                select(&value(*condition), &value(*accept), &value(*reject))
            }
            Expression::Relational { fun, argument } => {
                let argument = value(*argument);
                match fun {
                    RelationalFunction::All => Value::Bool(argument.parts().iter().all(Value::bool)),
                    RelationalFunction::Any => Value::Bool(argument.parts().iter().any(Value::bool)),
                    other => panic!("the interpreter does not know {other:?}"),
                }
            }
            Expression::Math { fun, arg, arg1, arg2, .. } => {
                let first = value(*arg);
                match (arg1.map(value), arg2.map(value)) {
                    (None, _) => map(&first, &|x| math_of_one(*fun, x)),
                    (Some(second), None) => zip(&first, &second, &|a, b| math_of_two(*fun, a, b)),
                    (Some(low), Some(high)) if *fun == MathFunction::Clamp => {
                        let above = zip(&first, &low, &|a, b| math_of_two(MathFunction::Max, a, b));
                        zip(&above, &high, &|a, b| math_of_two(MathFunction::Min, a, b))
                    }
                    _ => panic!("the interpreter does not know {fun:?}"),
                }
            }
            Expression::As { expr, kind, convert: Some(4) } => map(&value(*expr), &|x| convert(*kind, x)),
            fixed => self.fixed(fixed, &value),
        }
    }
}

fn zero_scalar(kind: ScalarKind) -> Value {
    match kind {
        ScalarKind::Float => Value::F32(0.0),
        ScalarKind::Sint => Value::I32(0),
        ScalarKind::Uint => Value::U32(0),
        ScalarKind::Bool => Value::Bool(false),
        other => panic!("the interpreter does not know {other:?}"),
    }
}

fn scalar_from_bytes(kind: ScalarKind, bytes: &[u8]) -> Value {
    let word = [bytes[0], bytes[1], bytes[2], bytes[3]];
    match kind {
        ScalarKind::Float => Value::F32(f32::from_ne_bytes(word)),
        ScalarKind::Sint => Value::I32(i32::from_ne_bytes(word)),
        ScalarKind::Uint => Value::U32(u32::from_ne_bytes(word)),
        other => panic!("no bytes make a {other:?}"),
    }
}

/// Component by component.
fn map(value: &Value, f: &dyn Fn(&Value) -> Value) -> Value {
    match value {
        Value::Many(parts) => Value::many(parts.iter().map(|part| map(part, f)).collect()),
        scalar => f(scalar),
    }
}

/// Component by component, a number with every component of a vector.
fn zip(a: &Value, b: &Value, f: &dyn Fn(&Value, &Value) -> Value) -> Value {
    match (a, b) {
        (Value::Many(a), Value::Many(b)) => {
            assert_eq!(a.len(), b.len(), "vectors of two lengths");
            Value::many(a.iter().zip(b.iter()).map(|(a, b)| f(a, b)).collect())
        }
        (Value::Many(a), b) => Value::many(a.iter().map(|a| f(a, b)).collect()),
        (a, Value::Many(b)) => Value::many(b.iter().map(|b| f(a, b)).collect()),
        (a, b) => f(a, b),
    }
}

fn select(condition: &Value, accept: &Value, reject: &Value) -> Value {
    match condition {
        Value::Bool(true) => accept.clone(),
        Value::Bool(false) => reject.clone(),
        each => {
            let parts = each.parts().iter().zip(accept.parts().iter().zip(reject.parts()));
            Value::many(parts.map(|(condition, (accept, reject))| select(condition, accept, reject)).collect())
        }
    }
}

fn unary(op: UnaryOperator, x: &Value) -> Value {
    match (op, x) {
        (UnaryOperator::Negate, Value::F32(x)) => Value::F32(-x),
        (UnaryOperator::Negate, Value::I32(x)) => Value::I32(x.wrapping_neg()),
        (UnaryOperator::LogicalNot, Value::Bool(x)) => Value::Bool(!x),
        other => panic!("the interpreter does not know {other:?}"),
    }
}

fn binary(op: BinaryOperator, a: &Value, b: &Value) -> Value {
    use BinaryOperator as Op;
    if let Some(verdict) = compare(op, a, b) {
        return Value::Bool(verdict);
    }
    match (op, a, b) {
        (Op::Add, Value::F32(a), Value::F32(b)) => Value::F32(a + b),
        (Op::Subtract, Value::F32(a), Value::F32(b)) => Value::F32(a - b),
        (Op::Multiply, Value::F32(a), Value::F32(b)) => Value::F32(a * b),
        (Op::Divide, Value::F32(a), Value::F32(b)) => Value::F32(a / b),
        (Op::Add, Value::I32(a), Value::I32(b)) => Value::I32(a.wrapping_add(*b)),
        (Op::Subtract, Value::I32(a), Value::I32(b)) => Value::I32(a.wrapping_sub(*b)),
        (Op::Multiply, Value::I32(a), Value::I32(b)) => Value::I32(a.wrapping_mul(*b)),
        (Op::Add, Value::U32(a), Value::U32(b)) => Value::U32(a.wrapping_add(*b)),
        (Op::Subtract, Value::U32(a), Value::U32(b)) => Value::U32(a.wrapping_sub(*b)),
        (Op::Multiply, Value::U32(a), Value::U32(b)) => Value::U32(a.wrapping_mul(*b)),
        (Op::And | Op::LogicalAnd, Value::Bool(a), Value::Bool(b)) => Value::Bool(*a && *b),
        (Op::InclusiveOr | Op::LogicalOr, Value::Bool(a), Value::Bool(b)) => Value::Bool(*a || *b),
        other => panic!("the interpreter does not know {other:?}"),
    }
}

/// The verdict of a comparison; `None` for what is none.
fn compare(op: BinaryOperator, a: &Value, b: &Value) -> Option<bool> {
    use BinaryOperator as Op;
    let order = match (a, b) {
        (Value::F32(a), Value::F32(b)) => a.partial_cmp(b),
        (Value::I32(a), Value::I32(b)) => Some(a.cmp(b)),
        (Value::U32(a), Value::U32(b)) => Some(a.cmp(b)),
        (Value::Bool(a), Value::Bool(b)) => Some(a.cmp(b)),
        _ => panic!("{a:?} and {b:?} are of two kinds"),
    };
    // What is not a number has no order: all but "not equal" are false then.
    match op {
        Op::Equal => Some(order.is_some_and(|order| order.is_eq())),
        Op::NotEqual => Some(order.is_none_or(|order| order.is_ne())),
        Op::Less => Some(order.is_some_and(|order| order.is_lt())),
        Op::LessEqual => Some(order.is_some_and(|order| order.is_le())),
        Op::Greater => Some(order.is_some_and(|order| order.is_gt())),
        Op::GreaterEqual => Some(order.is_some_and(|order| order.is_ge())),
        _ => None,
    }
}

fn math_of_one(fun: MathFunction, x: &Value) -> Value {
    let x = x.f32();
    Value::F32(match fun {
        MathFunction::Abs => x.abs(),
        MathFunction::Sin => x.sin(),
        MathFunction::Cos => x.cos(),
        MathFunction::Exp => x.exp(),
        MathFunction::Log => x.ln(),
        MathFunction::Sqrt => x.sqrt(),
        MathFunction::Round => x.round_ties_even(),
        other => panic!("the interpreter does not know {other:?}"),
    })
}

fn math_of_two(fun: MathFunction, a: &Value, b: &Value) -> Value {
    match (fun, a, b) {
        (MathFunction::Min, Value::I32(a), Value::I32(b)) => return Value::I32(*a.min(b)),
        (MathFunction::Max, Value::I32(a), Value::I32(b)) => return Value::I32(*a.max(b)),
        (MathFunction::Min, Value::U32(a), Value::U32(b)) => return Value::U32(*a.min(b)),
        (MathFunction::Max, Value::U32(a), Value::U32(b)) => return Value::U32(*a.max(b)),
        _ => {}
    }
    let (a, b) = (a.f32(), b.f32());
    Value::F32(match fun {
        MathFunction::Min => a.min(b),
        MathFunction::Max => a.max(b),
        MathFunction::Pow => a.powf(b),
        MathFunction::Atan2 => a.atan2(b),
        other => panic!("the interpreter does not know {other:?}"),
    })
}

fn convert(kind: ScalarKind, x: &Value) -> Value {
    match (kind, x) {
        (ScalarKind::Float, Value::F32(x)) => Value::F32(*x),
        (ScalarKind::Float, Value::I32(x)) => Value::F32(*x as f32),
        (ScalarKind::Float, Value::U32(x)) => Value::F32(*x as f32),
        (ScalarKind::Sint, Value::U32(x)) => Value::I32(*x as i32),
        // Towards 0, and to the nearest number that there is.
        (ScalarKind::Sint, Value::F32(x)) => Value::I32(*x as i32),
        (ScalarKind::Uint, Value::I32(x)) => Value::U32(*x as u32),
        other => panic!("the interpreter does not know {other:?}"),
    }
}
