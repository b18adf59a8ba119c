"""Messages of Protocol Buffers by Google's library, of a table of their fields."""

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory


def classes(contract):
    """Google's classes of the messages, by name.

    The contract has each message's fields: name, type (of a message: its name; ``*`` where it may
    come several times) and number.
    """
    file = descriptor_pb2.FileDescriptorProto(name="contract.proto", syntax="proto3", package="c")
    codes = descriptor_pb2.FieldDescriptorProto
    for name, fields in contract.items():
        message = file.message_type.add(name=name)
        for field in fields.split(", ") if fields else []:
            called, kind, number = field.split()
            one = message.field.add(name=called, number=int(number))
            one.label = codes.LABEL_REPEATED if "*" in kind else codes.LABEL_OPTIONAL
            kind = kind.strip("*")
            is_message = kind in contract
            code = codes.TYPE_MESSAGE if is_message else codes.Type.Value(f"TYPE_{kind.upper()}")
            one.type = code
            if is_message:
                one.type_name = f".c.{kind}"
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return {
        name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"c.{name}"))
        for name in contract
    }
