"""Desktop actions that xdotool lacks: drop a file, close and minimise a window, read the clipboard. Needs libX11 only."""

import ctypes

Window = Atom = ctypes.c_ulong
CLIENT_MESSAGE, SELECTION_REQUEST, SELECTION_NOTIFY = 33, 30, 31
XA_ATOM = 4
PROPERTY_REPLACE = 0


class ClientMessage(ctypes.Structure):
    _fields_ = [("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("send_event", ctypes.c_int),
                ("display", ctypes.c_void_p), ("window", Window), ("message_type", Atom), ("format", ctypes.c_int),
                ("data", ctypes.c_long * 5)]


class SelectionRequest(ctypes.Structure):
    _fields_ = [("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("send_event", ctypes.c_int),
                ("display", ctypes.c_void_p), ("owner", Window), ("requestor", Window), ("selection", Atom),
                ("target", Atom), ("property", Atom), ("time", ctypes.c_ulong)]


class Selection(ctypes.Structure):
    _fields_ = [("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("send_event", ctypes.c_int),
                ("display", ctypes.c_void_p), ("requestor", Window), ("selection", Atom), ("target", Atom),
                ("property", Atom), ("time", ctypes.c_ulong)]


class Event(ctypes.Union):
    _fields_ = [("type", ctypes.c_int), ("client", ClientMessage), ("request", SelectionRequest),
                ("selection", Selection), ("pad", ctypes.c_long * 24)]


class Desktop:
    """Simulates window manager and file manager."""

    def __init__(self, display):
        self.x = ctypes.CDLL("libX11.so.6")
        self.x.XOpenDisplay.restype = ctypes.c_void_p
        for name in ("XInternAtom", "XDefaultRootWindow", "XCreateSimpleWindow"):
            getattr(self.x, name).restype = ctypes.c_ulong
        self.display = ctypes.c_void_p(self.x.XOpenDisplay(display.encode()))
        if not self.display:
            raise RuntimeError(f"cannot open display {display}")

    def atom(self, name):
        return self.x.XInternAtom(self.display, name.encode(), 0)

    def send(self, window, kind, *data):
        event = Event()
        event.client = ClientMessage(CLIENT_MESSAGE, 0, 1, self.display, window, self.atom(kind), 32,
                                     (ctypes.c_long * 5)(*data))
        self.x.XSendEvent(self.display, Window(window), 0, ctypes.c_long(0), ctypes.byref(event))
        self.x.XFlush(self.display)

    def close(self, window):
        """Presses the close button."""
        self.send(window, "WM_PROTOCOLS", self.atom("WM_DELETE_WINDOW"), 0)

    def set_minimised(self, window, minimised):
        """Sets the property WM_STATE as window managers do: 1 normal, 3 iconic."""
        state = (ctypes.c_long * 2)(3 if minimised else 1, 0)
        name = Atom(self.atom("WM_STATE"))
        self.x.XChangeProperty(self.display, Window(window), name, name, 32, PROPERTY_REPLACE, ctypes.byref(state), 2)
        self.x.XFlush(self.display)

    def set_resources(self, text):
        """Sets what `xrdb` does, such as Xft.dpi. It lasts as long as some client is connected."""
        name, string = Atom(self.atom("RESOURCE_MANAGER")), Atom(self.atom("STRING"))
        self.x.XChangeProperty(self.display, Window(self.x.XDefaultRootWindow(self.display)), name, string, 8,
                               PROPERTY_REPLACE, text.encode(), len(text))
        self.x.XSync(self.display, 0)

    def drop(self, window, *uris):
        """Drops files by XDND version 5, from another window."""
        root = self.x.XDefaultRootWindow(self.display)
        source = self.x.XCreateSimpleWindow(self.display, Window(root), 0, 0, 1, 1, 0, Window(0), Window(0))
        selection, uri_list = self.atom("XdndSelection"), self.atom("text/uri-list")
        self.x.XSetSelectionOwner(self.display, Atom(selection), Window(source), ctypes.c_ulong(0))
        self.send(window, "XdndEnter", source, 5 << 24, uri_list, 0, 0)
        self.send(window, "XdndPosition", source, 0, 20 << 16 | 20, 0, self.atom("XdndActionCopy"))
        self.next_message("XdndStatus")
        self.send(window, "XdndDrop", source, 0, 0, 0, 0)
        self.next_message("XdndFinished", lambda request: self.hand_over(request, "".join(uri + "\r\n" for uri in uris)))
        self.x.XDestroyWindow(self.display, Window(source))
        self.x.XFlush(self.display)

    def hand_over(self, request, text):
        data = text.encode()
        self.x.XChangeProperty(self.display, Window(request.requestor), Atom(request.property), Atom(request.target),
                               8, PROPERTY_REPLACE, data, len(data))
        answer = Event()
        answer.selection = Selection(SELECTION_NOTIFY, 0, 1, self.display, request.requestor, request.selection,
                                     request.target, request.property, request.time)
        self.x.XSendEvent(self.display, Window(request.requestor), 0, ctypes.c_long(0), ctypes.byref(answer))
        self.x.XFlush(self.display)

    def next_message(self, kind, on_request=None):
        event, wanted = Event(), self.atom(kind)
        while True:
            self.x.XNextEvent(self.display, ctypes.byref(event))
            if event.type == SELECTION_REQUEST and on_request:
                on_request(event.request)
            if event.type == CLIENT_MESSAGE and event.client.message_type == wanted:
                return

    def clipboard(self):
        """The text that another program has put on the clipboard."""
        root = self.x.XDefaultRootWindow(self.display)
        window = Window(self.x.XCreateSimpleWindow(self.display, Window(root), 0, 0, 1, 1, 0, Window(0), Window(0)))
        utf8, place = Atom(self.atom("UTF8_STRING")), Atom(self.atom("PBM_CLIPBOARD"))
        self.x.XConvertSelection(self.display, Atom(self.atom("CLIPBOARD")), utf8, place, window, ctypes.c_ulong(0))
        event = Event()
        while event.type != SELECTION_NOTIFY:
            self.x.XNextEvent(self.display, ctypes.byref(event))
        kind, form, count, left, data = Atom(), ctypes.c_int(), ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_void_p()
        self.x.XGetWindowProperty(self.display, window, place, ctypes.c_long(0), ctypes.c_long(1 << 20), 0, Atom(0),
                                  ctypes.byref(kind), ctypes.byref(form), ctypes.byref(count), ctypes.byref(left),
                                  ctypes.byref(data))
        text = ctypes.string_at(data, count.value).decode()
        self.x.XDestroyWindow(self.display, window)
        self.x.XFlush(self.display)
        return text
