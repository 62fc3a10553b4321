!> A short key for source files and all that they include: it changes when one of them does.
module source_digest
  use text, only: string_t, lower_case
  use sha256, only: sha256_t, add_to_digest, sha256_text
  use whole_file, only: read_whole_file, take_line
  implicit none
  private

  public :: digest_t, add_text, add_file, add_contents, digest_text, whole_digest_text
  public :: included_name

  !> What texts and files are folded into.
  type :: digest_t
    type(sha256_t) :: sum
    type(string_t), allocatable :: files(:)   !! taken in so far
  end type digest_t

contains

  !> Fold a text in.
  pure subroutine add_text(digest, text)
    type(digest_t), intent(inout) :: digest
    character(*), intent(in) :: text

    call add_to_digest(digest%sum, text)
  end subroutine add_text

  !> Fold a file in with its path, and all files that it includes and that stand beside it.
  subroutine add_file(digest, path)
    type(digest_t), intent(inout) :: digest
    character(*), intent(in) :: path

    call add_text(digest, path)
    call add_contents(digest, path)
  end subroutine add_file

  !> Fold in what stands in a file and in all files that it includes and that stand beside it,
  !! wherever that is. Files that cannot be read count as empty: whoever needs them says so.
  recursive subroutine add_contents(digest, path)
    type(digest_t), intent(inout) :: digest
    character(*), intent(in) :: path
    character(:), allocatable :: content, folder, name, line
    type(string_t) :: entry
    integer :: i, first
    logical :: is_there

    if (.not. allocated(digest%files)) allocate (digest%files(0))
    do i = 1, size(digest%files)
      if (digest%files(i)%value == path) return
    end do
    entry%value = path
    digest%files = [digest%files, entry]
    call read_whole_file(path, content, is_there)
    call add_text(digest, content)
    folder = path(:index(path, "/", back=.true.))
    first = 1
    do while (first <= len(content))
      call take_line(content, first, line)
      name = included_name(line)
      if (name == "") cycle
      if (name(1:1) /= "/") name = folder//name
      inquire (file=name, exist=is_there)
      if (is_there) call add_contents(digest, name)
    end do
  end subroutine add_contents

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

  !> Sixteen hexadecimal digits, which show changes but not intent.
  function digest_text(digest) result(text)
    type(digest_t), intent(in) :: digest
    character(16) :: text
    character(64) :: whole

    whole = whole_digest_text(digest)
    text = whole(:len(text))
  end function digest_text

  !> Sixty-four hexadecimal digits, which nobody can make another source have.
  function whole_digest_text(digest) result(text)
    type(digest_t), intent(in) :: digest
    character(64) :: text

    text = sha256_text(digest%sum)
  end function whole_digest_text

end module source_digest
