"""The functions and classes of a C++ file by its braces: enough for this repository's style, no compiler needed."""
import re
from dataclasses import dataclass, field

TOKEN = re.compile(r'''//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![\w])'(?:\\.|[^'\\])+'|^[ \t]*\#(?:\\\n|[^\n])*''',
                   re.DOTALL | re.MULTILINE)
CLASS = re.compile(r'(?:^|[;>]|\btypedef\b)\s*(?:struct|class|union)\s+(?:alignas\s*\([^)]*\)\s*)?([\w:]+(?:<[^{]*>)?)?[^()=]*$')


@dataclass
class Scope:
    kind: str  # file, namespace, class, enum, function, braces
    name: str = ''
    first: int = 0  # line of its head
    head: str = ''
    fields: list = field(default_factory=list)


@dataclass
class Item:
    kind: str  # function, class
    name: str
    first: int
    last: int
    fields: list


def blank(text):
    """The text without comments, strings and preprocessor lines; every character that stays keeps its place."""
    def spaces(match):
        return re.sub(r'[^\n]', ' ', match[0])
    return TOKEN.sub(spaces, text)


def classify(head, inside):
    """What a `{` after `head` opens."""
    plain = re.sub(r'^\s*(?:(?:public|private|protected)\s*:)?\s*(?:template\s*<[^{]*?>\s*)?(?=struct|class|union|enum|namespace)', '',
                   re.sub(r'\b(?:public|private|protected)\s*:(?!:)', ' ', head)).strip()
    if inside in ('function', 'braces'):
        return 'braces', ''
    if re.match(r'(?:inline\s+)?namespace\b|extern\b', plain):
        return 'namespace', ''
    if re.match(r'enum\b', plain):
        return 'enum', ''
    found = CLASS.match(re.sub(r'^template\s*<.*>\s*(?=(?:struct|class|union)\b)', '', plain, flags=re.DOTALL))
    if found:
        return 'class', found[1] or '(unnamed)'
    before_initialisers = re.split(r'\)\s*(?:noexcept\s*)?:(?!:)', plain, maxsplit=1)
    if len(before_initialisers) == 2 and re.search(r'[\w>]$', plain):
        return 'initialiser', ''
    if '(' in plain and not re.search(r'=\s*$', plain):
        name = re.search(r'([\w:~]+|operator\s*\S+?)\s*\(', plain)
        return 'function', name[1] if name else '(unnamed)'
    return 'braces', ''


def declared(statement):
    """Names that a statement at class scope declares as fields."""
    text = re.sub(r'\b(?:public|private|protected)\s*:(?!:)', ' ', statement).strip()
    if not text or re.match(r'(?:using|friend|typedef|static|static_assert|template|enum|struct\s+\w+$|class\s+\w+$)\b', text):
        return []
    names, current, depth, value = [], '', 0, False
    for c in text + ',':
        if c in '<([{' and not (c == '<' and value):
            if c == '(' and depth == 0 and not value:
                return []  # a function
            depth += 1
        elif c in '>)]}' and not (c == '>' and value):
            depth -= 1
        elif c == '=' and depth == 0:
            value = True
        elif c == ',' and depth == 0:
            name = re.search(r'(\w+)\s*$', current)
            names += [name[1]] if name else []
            current, value = '', False
        elif depth == 0 and not value:
            current += c
    return names


def outline(text):
    """All functions and classes with their lines, in the order of their ends."""
    code = blank(text)
    stack, items = [Scope('file')], []
    head, head_line, line = '', 1, 1
    for c in code:
        if c == '{':
            kind, name = classify(head, stack[-1].kind)
            stack.append(Scope(kind, name, head_line, head))
            head = ''
        elif c == '}':
            if len(stack) == 1:
                raise ValueError(f'line {line}: a brace too many')
            scope = stack.pop()
            if scope.kind in ('function', 'class'):
                items.append(Item(scope.kind, scope.name, scope.first, line, scope.fields))
            keep = scope.kind == 'initialiser' or (scope.kind == 'braces' and stack[-1].kind in ('class', 'namespace', 'file'))
            head = scope.head + '{}' if keep else ''
            if keep:
                head_line = scope.first
        elif c == ';':
            if stack[-1].kind == 'class':
                stack[-1].fields += declared(head)
            head = ''
        else:
            if not head.strip() and not c.isspace():
                head, head_line = '', line
            head += c
            if re.search(r'(?:public|private|protected)\s*:$', head[-12:]):
                head = ''
        line += c == '\n'
    if len(stack) != 1:
        raise ValueError(f'line {stack[-1].first}: a brace is not closed')
    return items
