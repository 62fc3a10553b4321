!> What is known of a source file of a user without compiling it: its form, the files that it
!! includes, a digest of all of them, and the user subroutines in it that nothing here calls.
module user_sources
  use text, only: string_t, strings, append_text, joined, lower_case, upper_case
  use sha256, only: sha256_t, add_to_digest, sha256_text
  use child_process, only: run_program
  use system_files, only: folder_of
  use text_file, only: read_whole_file, take_line
  implicit none
  private

  public :: is_source, is_c_source, kinds_of, is_fixed_form, has_directives, provide_includes
  public :: uncalled_routines, do_define, ending_of, as_file, write_text
  public :: digest_t, add_text, add_file, add_contents, digest_text

  !> What texts and files are folded into.
  type :: digest_t
    type(sha256_t) :: sum
    type(string_t), allocatable :: files(:)   !! taken in so far
  end type digest_t

  integer, parameter :: backslash = 92   ! its code

contains

  !> Is it Fortran source, by its ending?
  pure logical function is_source(path)
    character(*), intent(in) :: path

    is_source = any(ending_of(path) == [character(3) :: "f", "for", "ftn", "f77", "f90", "f95", &
                                        "f03", "f08", "fpp"])
  end function is_source

  !> Is it C or C++, by its ending?
  pure logical function is_c_source(path)
    character(*), intent(in) :: path

    is_c_source = any(ending_of(path) == [character(3) :: "c", "cc", "cpp", "cxx"])
  end function is_c_source

  !> What the files are, such as "Fortran source, C++ source".
  function kinds_of(files) result(kinds)
    type(string_t), intent(in) :: files(:)
    character(:), allocatable :: kinds, kind
    integer :: i

    kinds = ""
    do i = 1, size(files)
      kind = "objects"
      if (is_source(files(i)%value)) kind = "Fortran source"
      if (is_c_source(files(i)%value)) kind = "C++ source"
      if (ending_of(files(i)%value) == "c") kind = "C source"
      if (index(kinds//", ", ", "//kind//", ") == 0) kinds = kinds//", "//kind
    end do
    kinds = kinds(3:)
  end function kinds_of

  !> Is the file in fixed form? By its name, unless a directive of other compilers says free form.
  logical function is_fixed_form(path)
    character(*), intent(in) :: path
    character(:), allocatable :: content
    logical :: is_there

    is_fixed_form = .false.
    if (.not. any(ending_of(path) == [character(3) :: "f", "for", "ftn", "f77", "fpp"])) return
    call read_whole_file(path, content, is_there)
    content = upper_case(content)
    is_fixed_form = index(content, "!DIR$ FREEFORM") == 0 .and. &
                    index(content, "!DEC$ FREEFORM") == 0
  end function is_fixed_form

  !> Does the file have lines for the preprocessor, such as #include?
  logical function has_directives(path)
    character(*), intent(in) :: path
    character(:), allocatable :: content
    logical :: is_there

    call read_whole_file(path, content, is_there)
    has_directives = index(new_line("a")//content, new_line("a")//"#") > 0
  end function has_directives

  !> Put copies of included files into `target` that are not there by the name that the source has,
  !! but by one in other letters (names that differ in case alone, or with \ for /, are the same
  !! under Windows).
  subroutine provide_includes(path, target, support, found)
    character(*), intent(in) :: path                 !! of the source
    character(*), intent(in) :: target               !! folder for the copies
    character(*), intent(in) :: support              !! folder of our own include files
    type(string_t), allocatable, intent(inout) :: found(:)   !! files that copies were made of
    type(string_t), allocatable :: open_files(:), names(:)
    character(:), allocatable :: source, name, content
    logical :: is_there
    integer :: i, j, k

    open_files = strings([path])
    i = 0
    do while (i < size(open_files))
      i = i + 1
      call read_whole_file(open_files(i)%value, content, is_there)
      names = included_files(content)
      do k = 1, size(names)
        name = names(k)%value
        source = as_it_stands(folder_of(path), support, name)
        if (source == "") then
          ! A copy by this name would not lie in the folder for copies.
          if (index(name, "/") == 1 .or. index("/"//with_slashes(name)//"/", "/../") > 0) cycle
          source = in_other_letters(folder_of(path), target, name)
          if (source == "") source = in_other_letters(support, target, name)
          if (source == "") cycle
          call read_whole_file(source, content, is_there)
          call write_text(target//"/"//name, content)
          call append_text(found, source)
        end if
        if (.not. any([(open_files(j)%value == source, j=1, size(open_files))])) &
          call append_text(open_files, source)
      end do
    end do
  end subroutine provide_includes

  !> Names of the files that a source includes.
  pure function included_files(content) result(names)
    character(*), intent(in) :: content   !! of the source
    type(string_t), allocatable :: names(:)
    character(:), allocatable :: line, name
    integer :: first

    allocate (names(0))
    first = 1
    do while (first <= len(content))
      call take_line(content, first, line)
      name = included_name(line)
      if (name /= "") call append_text(names, name)
    end do
  end function included_files

  !> The file that a line includes, empty where it includes none.
  pure function included_name(line) result(name)
    character(*), intent(in) :: line
    character(:), allocatable :: name, code
    integer :: first, last
    character(1) :: quote

    name = ""
    code = adjustl(line)
    if (len(code) < 10) return
    if (lower_case(code(1:7)) /= "include" .and. lower_case(code(1:8)) /= "#include") return
    first = scan(code, "'""")
    if (first == 0) return
    quote = code(first:first)
    last = index(code(first + 1:), quote)
    if (last > 1) name = code(first + 1:first + last - 1)
  end function included_name

  !> Path of an included file that exists by its very name; empty if none does.
  function as_it_stands(folder, support, name) result(path)
    character(*), intent(in) :: folder, support, name
    character(:), allocatable :: path
    logical :: is_there

    path = name
    inquire (file=path, exist=is_there)
    if (name(1:1) == "/" .and. is_there) return
    path = folder//"/"//name
    inquire (file=path, exist=is_there)
    if (is_there) return
    path = support//"/"//name
    inquire (file=path, exist=is_there)
    if (.not. is_there) path = ""
  end function as_it_stands

  !> Path of a file whose name differs in the case of its letters and in the kind of slash alone;
  !! empty if there is none.
  function in_other_letters(folder, room, name) result(path)
    character(*), intent(in) :: folder, name
    character(*), intent(in) :: room        !! folder that may be written to
    character(:), allocatable :: path, rest, part, entry
    integer :: length

    path = folder
    rest = with_slashes(name)
    do while (rest /= "")
      length = index(rest//"/", "/")
      part = rest(:length - 1)
      rest = rest(min(length, len(rest)) + 1:)
      if (part == "" .or. part == ".") cycle
      entry = part
      if (part /= "..") entry = entry_of(path, room, part)
      if (entry == "") then
        path = ""
        return
      end if
      path = path//"/"//entry
    end do
  end function in_other_letters

  !> The entry of a folder that has this name but for the case of letters; empty if there is none.
  function entry_of(folder, room, name) result(entry)
    character(*), intent(in) :: folder, room, name
    character(:), allocatable :: entry, listing
    type(string_t) :: words(2)
    logical :: is_there
    integer :: code, first

    words(1)%value = "ls"
    words(2)%value = as_file(folder)
    call run_program(words, room//"/listing.txt", code)
    call read_whole_file(room//"/listing.txt", listing, is_there)
    first = 1
    do while (first <= len(listing))
      call take_line(listing, first, entry)
      if (lower_case(entry) == lower_case(name)) return
    end do
    entry = ""
  end function entry_of

  pure function with_slashes(path) result(changed)
    character(*), intent(in) :: path
    character(len(path)) :: changed
    integer :: i

    changed = path
    do i = 1, len(path)
      if (iachar(path(i:i)) == backslash) changed(i:i) = "/"
    end do
  end function with_slashes

  !> Write a file for the compiler, which will miss it where that fails.
  subroutine write_text(path, content)
    character(*), intent(in) :: path, content
    integer :: unit, status

    open (newunit=unit, file=path, access="stream", form="unformatted", action="write", &
          status="replace", iostat=status)
    if (status /= 0) return
    write (unit, iostat=status) content
    close (unit)
  end subroutine write_text

  !> Names of the user subroutines in some sources that have their place in Abaqus and none here,
  !! or that the deck does not name, set apart by commas; empty if there are none.
  function uncalled_routines(files, named) result(names)
    type(string_t), intent(in) :: files(:)
    type(string_t), intent(in) :: named(:)   !! by the deck
    character(:), allocatable :: names, content
    character(*), parameter :: known(30) = [character(8) :: "USDFLD", "VUSDFLD", "UHARD", &
      "VUHARD", "UVARM", "UVARMEXP", "DISP", "VDISP", "DLOAD", "VDLOAD", "UTRACLOA", "SIGINI", &
      "ORIENT", "UEL", "VUEL", "UMATHT", "UEXPAN", "VUEXPAN", "HETVAL", "CREEP", "UAMP", &
      "VUAMP", "FRIC", "VFRIC", "UINTER", "VUINTER", "URDFIL", "MPC", "UTEMP", "UFIELD"]
    logical :: is_there
    integer :: i, k

    names = ""
    do i = 1, size(files)
      if (.not. is_source(files(i)%value)) cycle
      call read_whole_file(files(i)%value, content, is_there)
      content = upper_case(content)
      do k = 1, size(known)
        if (.not. has_routine(content, trim(known(k)))) cycle
        if (index(", "//names//", "//joined(named, ", ")//",", ", "//trim(known(k))//",") > 0) cycle
        names = names//", "//trim(known(k))
        if (names(1:1) == ",") names = names(3:)
      end do
    end do
  end function uncalled_routines

  !> Does one of the files that are sources hold this subroutine?
  logical function do_define(files, name)
    type(string_t), intent(in) :: files(:)
    character(*), intent(in) :: name         !! upper case
    character(:), allocatable :: content
    logical :: is_there
    integer :: i

    do_define = .false.
    do i = 1, size(files)
      if (do_define .or. .not. is_source(files(i)%value)) cycle
      call read_whole_file(files(i)%value, content, is_there)
      if (is_there) do_define = has_routine(upper_case(content), name)
    end do
  end function do_define

  !> Does a line begin with SUBROUTINE and this name?
  pure logical function has_routine(content, name)
    character(*), intent(in) :: content   !! upper case
    character(*), intent(in) :: name
    character(*), parameter :: word = "SUBROUTINE"
    integer :: place, start, last

    has_routine = .false.
    start = 1
    do
      place = index(content(start:), word)
      if (place == 0) return
      place = place + start - 1
      start = place + len(word)
      if (.not. is_first_on_line(content(:place - 1))) cycle
      last = verify(content(start:), " ")
      if (last == 0) return
      last = start + last - 1
      if (index(content(last:), name) /= 1) cycle
      last = last + len(name)
      if (last > len(content)) return
      has_routine = scan(content(last:last), "( &!"//achar(9)//achar(10)//achar(13)) > 0
      if (has_routine) return
    end do
  end function has_routine

  !> Is there nothing but spaces after the last line end?
  pure logical function is_first_on_line(content)
    character(*), intent(in) :: content
    integer :: last

    last = verify(content, " "//achar(9), back=.true.)
    is_first_on_line = last == 0
    if (last > 0) is_first_on_line = content(last:last) == new_line("a")
  end function is_first_on_line

  !> The ending of a file name in lower case, without its dot; that of a shared library with a
  !! version after it (lib.so.1.2) is "so".
  pure function ending_of(path) result(ending)
    character(*), intent(in) :: path
    character(:), allocatable :: ending
    integer :: place

    ending = ""
    if (index(path, ".") > 0) ending = lower_case(path(index(path, ".", back=.true.) + 1:))
    place = index(path, ".so.", back=.true.)
    if (place == 0) return
    if (verify(path(place + 4:), "0123456789.") == 0) ending = "so"
  end function ending_of

  !> A path that no program takes for an option.
  pure function as_file(path) result(file)
    character(*), intent(in) :: path
    character(:), allocatable :: file

    file = path
    if (path(1:1) == "-") file = "./"//path
  end function as_file

  !> Fold in a text.
  pure subroutine add_text(digest, text)
    type(digest_t), intent(inout) :: digest
    character(*), intent(in) :: text

    call add_to_digest(digest%sum, text)
  end subroutine add_text

  !> Fold in a file with its path, and all files that it includes and that lie next to it.
  subroutine add_file(digest, path)
    type(digest_t), intent(inout) :: digest
    character(*), intent(in) :: path

    call add_text(digest, path)
    call add_contents(digest, path)
  end subroutine add_file

  !> Fold in the text of a file and of all files that it includes and that lie next to it, wherever
  !! that is. Files that cannot be read count as empty: whoever needs them reports them.
  recursive subroutine add_contents(digest, path)
    type(digest_t), intent(inout) :: digest
    character(*), intent(in) :: path
    type(string_t), allocatable :: names(:)
    character(:), allocatable :: content, name
    integer :: i
    logical :: is_there

    if (.not. allocated(digest%files)) allocate (digest%files(0))
    if (any([(digest%files(i)%value == path, i=1, size(digest%files))])) return
    call append_text(digest%files, path)
    call read_whole_file(path, content, is_there)
    call add_text(digest, content)
    names = included_files(content)
    do i = 1, size(names)
      name = names(i)%value
      if (name(1:1) /= "/") name = path(:index(path, "/", back=.true.))//name
      inquire (file=name, exist=is_there)
      if (is_there) call add_contents(digest, name)
    end do
  end subroutine add_contents

  !> Sixteen hexadecimal digits, which show changes but not intent.
  function digest_text(digest) result(text)
    type(digest_t), intent(in) :: digest
    character(16) :: text
    character(64) :: whole

    whole = sha256_text(digest%sum)
    text = whole(:len(text))
  end function digest_text

end module user_sources
