//! `messages.rs`: a struct for each message type of the space.

use proc_macro2::TokenStream;
use quote::quote;
use sesame_plan::{CampaignPlan, Field, MessageId, MessageType, Type};

use super::rust;
use crate::names::{self, Scope};

/// How types are reached from where they are written.
#[derive(Debug, Clone, Copy)]
pub(super) struct TypePaths {
    /// What stands before `Text`.
    pub(super) text: &'static str,
    /// What stands before the struct of a message.
    pub(super) messages: &'static str,
}

impl TypePaths {
    /// Everything is imported by name.
    pub(super) const IMPORTED: TypePaths = TypePaths { text: "", messages: "" };
    /// `Text` and the module `messages` are imported.
    pub(super) const BY_MODULE: TypePaths = TypePaths { text: "", messages: "messages::" };
    /// Nothing is imported.
    pub(super) const WHOLE: TypePaths =
        TypePaths { text: "::sesame_runtime::value::", messages: "crate::generated::messages::" };
}

/// How the message types of a space are called in Rust.
pub(super) struct Messages<'a> {
    plan: &'a CampaignPlan,
    types: Vec<String>,
    fields: Vec<Vec<String>>,
}

impl<'a> Messages<'a> {
    pub(super) fn new(plan: &'a CampaignPlan) -> Self {
        // What stands beside the structs here, in a stub, or in code that a user is likely to write there.
        let mut scope = Scope::reserving(&["Box", "Context", "Default", "Option", "Result", "String", "Text", "Vec"]);
        let types = plan.messages.iter().map(|message| scope.take(names::camel(&message.name), "Message")).collect();
        let fields = plan.messages.iter().map(|message| field_names(&message.fields)).collect();
        Messages { plan, types, fields }
    }

    /// The struct of a message type.
    pub(super) fn struct_name(&self, id: MessageId) -> &str {
        &self.types[id.index()]
    }

    /// Fields with their names in Rust.
    pub(super) fn fields(&self, id: MessageId) -> impl Iterator<Item = (&'a Field, &str)> {
        self.plan.message(id).fields.iter().zip(self.fields[id.index()].iter().map(String::as_str))
    }

    /// A type as the field of a struct has it, as text: `Text` and the structs of messages by their mere names, or
    /// with what `type_paths` puts before them.
    pub(super) fn owned(&self, ty: &Type, type_paths: TypePaths) -> String {
        match ty {
            Type::Bool => "bool".to_owned(),
            Type::Int { .. } => "i64".to_owned(),
            Type::Real { .. } => "f64".to_owned(),
            Type::Text => format!("{}Text", type_paths.text),
            Type::Point { .. } => "[f64; 3]".to_owned(),
            Type::List { of } => format!("Vec<{}>", self.owned(of, type_paths)),
            Type::Message { id } => format!("{}{}", type_paths.messages, names::written(self.struct_name(*id))),
        }
    }

    /// A type as a handler takes it: small ones by value, others by reference.
    pub(super) fn borrowed(&self, ty: &Type, type_paths: TypePaths) -> String {
        match ty {
            Type::Bool | Type::Int { .. } | Type::Real { .. } | Type::Point { .. } => self.owned(ty, type_paths),
            Type::Text | Type::Message { .. } => format!("&{}", self.owned(ty, type_paths)),
            Type::List { of } => format!("&[{}]", self.owned(of, type_paths)),
        }
    }

    /// What makes a payload of a message.
    fn to_value(&self, id: MessageId, message: &MessageType) -> TokenStream {
        let name = names::ident(self.struct_name(id));
        let made = self.fields(id).map(|(field, rust_name)| {
            let (name, wire) = (names::ident(rust_name), &field.name);
            quote! { (#wire, ::sesame_runtime::message::ToValue::to_value(&self.#name)) }
        });
        let put = self.fields(id).map(|(field, rust_name)| {
            let (name, wire) = (names::ident(rust_name), &field.name);
            quote! { changed |= ::sesame_runtime::message::write_field(value, #wire, &self.#name); }
        });
        let write = if message.fields.is_empty() {
            quote! { let _ = value; false }
        } else {
            quote! { let mut changed = false; #(#put)* changed }
        };
        quote! {
            impl ::sesame_runtime::message::ToValue for #name {
                fn to_value(&self) -> ::sesame_runtime::value::Value {
                    ::sesame_runtime::message::record(&[#(#made),*])
                }

                fn write_to(&self, value: &mut ::sesame_runtime::value::Value) -> bool {
                    #write
                }
            }
        }
    }

    /// The file.
    ///
    /// Only hooks of operations make payloads of messages; `written` says whether there are any.
    pub(super) fn file(&self, header: &str, written: bool) -> String {
        let structs = (0..).map(MessageId).zip(&self.plan.messages).map(|(id, message)| {
            let name = names::ident(self.struct_name(id));
            let docs = rust::docs(message.doc.lines());
            let fields = self.fields(id).map(|(field, rust_name)| {
                let docs = field_docs(field);
                let ty = self.owned(&field.ty, TypePaths::IMPORTED);
                let ty = if field.optional { format!("Option<{ty}>") } else { ty };
                let (name, ty) = (names::ident(rust_name), tokens(&ty));
                quote! { #docs pub #name: #ty }
            });
            let reads = self.fields(id).map(|(field, rust_name)| {
                let (name, wire) = (names::ident(rust_name), &field.name);
                let read = names::ident(if field.optional { "optional_field" } else { "field" });
                quote! { #name: ::sesame_runtime::message::#read(value, #wire)? }
            });
            // A message without fields still has to be a message.
            let value = if message.fields.is_empty() { quote!(_value) } else { quote!(value) };
            let to_value = written.then(|| self.to_value(id, message));
            quote! {
                #docs
                #[derive(Debug, Clone, PartialEq)]
                pub struct #name { #(#fields,)* }

                #to_value

                impl ::sesame_runtime::message::FromValue for #name {
                    fn from_value(
                        #value: &::sesame_runtime::value::Value,
                    ) -> ::core::result::Result<Self, ::sesame_runtime::message::Mismatch> {
                        ::core::result::Result::Ok(Self { #(#reads,)* })
                    }
                }
            }
        });
        let text = self
            .plan
            .messages
            .iter()
            .any(|message| message.fields.iter().any(|field| holds_text(&field.ty)))
            .then(|| quote! { use ::sesame_runtime::value::Text; });
        let docs = rust::module_docs([format!("The messages of `{}`, as hooks see them.", self.plan.space)]);
        rust::file(
            header,
            quote! {
                #docs
                #![allow(dead_code, reason = "a campaign need not use all messages of its space")]
                #text
                #(#structs)*
            },
        )
    }
}

/// Names of fields: distinct, in snake case.
fn field_names(fields: &[Field]) -> Vec<String> {
    let mut scope = Scope::default();
    fields.iter().map(|field| scope.take(names::snake(&field.name), "_")).collect()
}

/// The docs of a field: its own, then its unit and, where that differs from the field's, its name on the wire.
fn field_docs(field: &Field) -> TokenStream {
    let unit = unit(&field.ty).map(|unit| format!("In {unit}."));
    let wire = (names::snake(&field.name) != field.name).then(|| format!("`{}` on the wire.", field.name));
    rust::docs(field.doc.lines().map(str::to_owned).chain(unit).chain(wire))
}

/// The unit of a type, of its elements if it is a list.
pub(super) fn unit(ty: &Type) -> Option<&str> {
    match ty {
        Type::Int { unit } | Type::Real { unit } | Type::Point { unit } => unit.as_deref(),
        Type::List { of } => unit(of),
        Type::Bool | Type::Text | Type::Message { .. } => None,
    }
}

/// Whether `Text` occurs in a type when it is written out.
pub(super) fn holds_text(ty: &Type) -> bool {
    match ty {
        Type::Text => true,
        Type::List { of } => holds_text(of),
        _ => false,
    }
}

/// The message type that is named in a type when it is written out.
pub(super) fn named_message(ty: &Type) -> Option<MessageId> {
    match ty {
        Type::Message { id } => Some(*id),
        Type::List { of } => named_message(of),
        _ => None,
    }
}

/// Tokens of a type written by this module.
pub(super) fn tokens(ty: &str) -> TokenStream {
    ty.parse().expect("types are made of checked names")
}
