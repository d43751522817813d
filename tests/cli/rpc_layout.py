# SPDX-License-Identifier: Apache-2.0
# Where Cap'n Proto's compiler puts the fields of messages, in the form that the client in Python
# has it (cli/rpc/veduta_rpc.py says what that is).
import re
import subprocess

SCALARS = {'bool': 'bool', 'uint8': 'u8', 'uint16': 'u16', 'uint32': 'u32', 'uint64': 'u64',
           'int64': 'i64', 'float64': 'f64', 'text': 'text', 'data': 'data', 'void': 'void'}
# What a client needs of Cap'n Proto's own messages.
OWN_MESSAGES = ('Message', 'Bootstrap', 'Call', 'Return', 'Finish', 'Resolve', 'Release',
                'MessageTarget', 'Payload', 'CapDescriptor', 'PromisedAnswer', 'PromisedAnswer.Op',
                'Exception')
EMPTY = {'struct': {'dataWordCount': 0, 'pointerCount': 0, 'fields': []}}


TOKEN = re.compile(r'\s*("(?:[^"\\]|\\.)*"|<[^>]*>|[()\[\],=]|[^\s()\[\],="<]+)')


def parsed(text):
    """A message as Cap'n Proto prints it: structs as dicts, lists, and the rest as text."""
    tokens = TOKEN.findall(text)
    tokens.reverse()

    def value():
        token = tokens.pop()
        if token == '(':
            fields = {}
            while tokens[-1] != ')':
                name = tokens.pop()
                assert tokens.pop() == '=', name
                fields[name] = value()
                if tokens[-1] == ',':
                    tokens.pop()
            tokens.pop()
            return fields
        if token == '[':
            items = []
            while tokens[-1] != ']':
                items.append(value())
                if tokens[-1] == ',':
                    tokens.pop()
            tokens.pop()
            return items
        return token.strip('"')

    return value()


def nodes(path):
    """Each node of a schema by its number; the numbers of those in the file itself."""
    compiled = subprocess.run(['capnp', 'compile', '-o-', path], capture_output=True, check=True)
    text = subprocess.run(['capnp', 'convert', 'binary:text', '/usr/include/capnp/schema.capnp',
                           'CodeGeneratorRequest'], input=compiled.stdout, capture_output=True,
                          check=True).stdout
    request = parsed(text.decode())
    return {node['id']: node for node in request['nodes']}, request['requestedFiles'][0]['filename']


def name_of(node):
    return node['displayName'].split(':')[-1]


def type_of(kind, by_id):
    (word, detail), = kind.items()
    if word in SCALARS:
        return SCALARS[word]
    if word == 'list':
        return '[' + type_of(detail['elementType'], by_id) + ']'
    if word == 'struct':
        return name_of(by_id[detail['typeId']])
    return {'enum': 'u16', 'interface': 'cap', 'anyPointer': 'any'}[word]


def field_of(field, by_id):
    slot = field['slot']
    text = f'{field["name"]}:{type_of(slot["type"], by_id)}@{slot.get("offset", 0)}'
    if int(field.get('discriminantValue', 65535)) != 65535:
        text += f'?{field["discriminantValue"]}'
    if slot.get('defaultValue', {}).get('bool') == 'true':
        text += '!'
    return text


def layout_of(name, node, by_id):
    """NAME WORDS POINTERS [?OFFSET of the tag of its union] FIELD:TYPE@OFFSET[?TAG][!]..."""
    struct = node['struct']
    parts = [name, str(struct['dataWordCount']), str(struct['pointerCount'])]
    if int(struct.get('discriminantCount', 0)):
        parts.append(f'?{struct["discriminantOffset"]}')
    # Groups are left out: the client sends their defaults.
    return ' '.join(parts + [field_of(field, by_id) for field in struct.get('fields', [])
                             if 'slot' in field])


def layouts(schema):
    """The lines of all messages of the schema, and of those of Cap'n Proto."""
    lines = []
    for path in ('/usr/include/capnp/rpc.capnp', schema):
        by_id, filename = nodes(path)
        for node in by_id.values():
            name = name_of(node)
            if not node['displayName'].endswith(':' + name) or 'struct' not in node:
                continue
            if path == schema:
                if filename not in node['displayName'] or '.' in name:
                    continue
            elif name not in OWN_MESSAGES:
                continue
            lines.append(layout_of(name, node, by_id))
        if path == schema:
            lines += methods(by_id, filename)
    return sorted(lines)


def methods(by_id, filename):
    """INTERFACE.METHOD INTERFACE'S NUMBER METHOD'S NUMBER, and what it takes and returns."""
    lines = []
    for node in by_id.values():
        if 'interface' not in node or filename not in node['displayName']:
            continue
        for number, method in enumerate(node['interface']['methods']):
            name = f'{name_of(node)}.{method["name"]}'
            lines.append(f'{name} {node["id"]} {number}')
            for suffix, key in (('()', 'paramStructType'), ('=', 'resultStructType')):
                lines.append(layout_of(name + suffix, by_id.get(method[key], EMPTY), by_id))
    return lines


if __name__ == '__main__':
    import sys
    print('\n'.join(layouts(sys.argv[1])))
